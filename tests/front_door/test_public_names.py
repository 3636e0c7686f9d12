"""The front door: every public name is there, typed, and costs little."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import firmware_runtime

HEAVY = {
    "numpy",
    "argparse",
    "smbus2",
    "serial",
    "gpiod",
    "msgspec",
    "importlib.metadata",
    "socket",
}


def shown_to_type_checkers() -> dict[str, str]:
    """Each name that is imported where only type checkers look, and from which module."""
    tree = ast.parse(Path(str(firmware_runtime.__file__)).read_text(encoding="utf-8"))
    block = next(each for each in tree.body if isinstance(each, ast.If))
    imports = [each for each in block.body if isinstance(each, ast.ImportFrom)]
    return {alias.name: str(each.module) for each in imports for alias in each.names}


def modules_after(code: str) -> set[str]:
    """What an interpreter has loaded that ran this code."""
    show = "import sys; print('\\n'.join(sys.modules))"
    program = [sys.executable, "-c", f"{code}\n{show}"]
    done = subprocess.run(program, check=True, capture_output=True, text=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("name", firmware_runtime.__all__)
def test_every_public_name_is_what_its_module_defines(name: str) -> None:
    module = import_module(shown_to_type_checkers()[name])
    assert getattr(firmware_runtime, name) is getattr(module, name)


def test_type_checkers_and_readers_see_the_same_names() -> None:
    assert set(shown_to_type_checkers()) == set(firmware_runtime.__all__)
    assert len(set(firmware_runtime.__all__)) == len(firmware_runtime.__all__)


def test_all_names_can_be_imported_at_once() -> None:
    found: dict[str, object] = {}
    exec("from firmware_runtime import *", found)  # noqa: S102 -- no other way within a function
    assert set(firmware_runtime.__all__) <= set(found)


def test_a_public_name_is_listed_before_its_first_use() -> None:
    assert set(firmware_runtime.__all__) <= set(dir(firmware_runtime))


def test_an_unknown_name_is_refused_as_by_any_module() -> None:
    with pytest.raises(AttributeError, match="Atomik"):
        _ = firmware_runtime.Atomik  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "name", [each for each in firmware_runtime.__all__ if each.endswith(("Error", "Absent"))]
)
def test_every_public_error_has_the_one_root(name: str) -> None:
    assert issubclass(getattr(firmware_runtime, name), firmware_runtime.FirmwareRuntimeError)


def test_importing_the_package_loads_no_other_module_of_it() -> None:
    loaded = modules_after("import firmware_runtime")
    assert {each for each in loaded if each.startswith("firmware_runtime.")} == set()


def test_writing_a_model_and_simulating_it_loads_nothing_heavy() -> None:
    asked_for = "from firmware_runtime import Atomic, ClassicSimulator, Coupled, Simulator"
    assert HEAVY & (modules_after(asked_for) - modules_after("")) == set()


@pytest.mark.slow
def test_not_even_all_names_together_load_what_only_some_robots_need() -> None:
    not_needed = {"numpy", "argparse", "smbus2", "serial", "gpiod", "rich", "prometheus_client"}
    assert not_needed & modules_after("from firmware_runtime import *") == set()
