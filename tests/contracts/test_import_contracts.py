"""Imports point one way; the contracts are in pyproject.toml. No modules import in a circle."""

import re
import tomllib
from graphlib import TopologicalSorter
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import grimp
import pytest
from importlinter import cli

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles", "benchmarks")


@pytest.mark.slow
def test_every_import_contract_is_kept() -> None:
    assert cli.lint_imports(no_cache=True) == cli.EXIT_STATUS_SUCCESS


@pytest.mark.slow
def test_no_modules_import_each_other_in_a_circle_for_types_neither() -> None:
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    order = list(TopologicalSorter(imports).static_order())  # raises CycleError, with the circle
    assert len(order) == len(graph.modules)


def rows_of_the_tour() -> list[list[str]]:
    """The folders of each row of the tables in docs/tour.md."""
    page = (ROOT / "docs" / "tour.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (`.*?`) \|", page, re.MULTILINE)
    return [re.findall(r"`(\w+)`", cell) for cell in cells]


def layers() -> list[list[str]]:
    """The rooms of each layer of the first two contracts, without those that are a file."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    tops, rooms, *_ = project["tool"]["importlinter"]["contracts"]
    named = [layer.split(" | ") for layer in (*tops["layers"][:-1], *rooms["layers"])]
    folders = [[name.rpartition(".")[2] for name in layer if is_folder(name)] for layer in named]
    return [layer for layer in folders if layer]


def is_folder(module: str) -> bool:
    found = find_spec(module)
    return found is not None and found.submodule_search_locations is not None


def test_every_room_is_in_a_layer() -> None:
    folders = {each.parent.name for each in (ROOT / "firmware_runtime").glob("*/__init__.py")}
    assert folders <= set(chain.from_iterable(layers()))


def test_the_tour_has_every_room_in_its_layer() -> None:
    assert rows_of_the_tour() == layers()
