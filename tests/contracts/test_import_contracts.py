"""Imports point one way; the contracts are in pyproject.toml. No modules import in a circle."""

from graphlib import TopologicalSorter

import grimp
import pytest
from importlinter import cli

PACKAGES = ("firmware_runtime", "drivers", "boards", "sim_doubles", "benchmarks")


@pytest.mark.slow
def test_every_import_contract_is_kept() -> None:
    assert cli.lint_imports(no_cache=True) == cli.EXIT_STATUS_SUCCESS


@pytest.mark.slow
def test_no_modules_import_each_other_in_a_circle_for_types_neither() -> None:
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    order = list(TopologicalSorter(imports).static_order())  # raises CycleError, with the circle
    assert len(order) == len(graph.modules)
