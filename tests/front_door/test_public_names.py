"""The front door: its names, the pages that show it, and ports of a run."""

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import firmware_runtime
from firmware_runtime import (
    SECOND,
    Atomic,
    ConfigError,
    Coupled,
    FirmwareRuntimeError,
    UnknownName,
    open_board,
    open_model,
)
from firmware_runtime.statistics import port_values
from firmware_runtime.system.packages import install_command
from tests.support.command import in_python
from tests.support.pages import Example, examples, printed

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
    done = in_python(f"{code}\n{show}", check=True)
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


(HOME,) = examples("index.md")
FIRST, *OTHERS = examples("first-model.md")
(README,) = examples("../README.md")
WITH_ROBOTS = [*examples("testing.md"), *examples("campaign.md")]
(SWEEP,) = examples("experiments.md")


def lines_of_code(program: str) -> int:
    return sum(1 for line in program.splitlines() if line.strip())


@pytest.mark.slow
@pytest.mark.real_time
def test_the_ten_lines_of_the_home_page_print_what_it_says() -> None:
    assert lines_of_code(HOME.program) <= 10
    assert printed(HOME.program) == HOME.output


@pytest.mark.slow
@pytest.mark.real_time
def test_the_model_of_the_readme_prints_what_it_says() -> None:
    assert printed(README.program) == README.output


@pytest.mark.slow
@pytest.mark.real_time
def test_the_first_model_prints_what_the_page_says_in_real_time() -> None:
    said = printed(FIRST.program)
    assert _NUMBERS.sub("N", said) == _NUMBERS.sub("N", FIRST.output)
    (activations,) = re.findall(r"(\d+) activations", said)
    assert 0 < int(activations) <= 6, "a busy machine comes too late for the last"


_NUMBERS = re.compile(r"\d+(?:\.\d+)?")


@pytest.mark.slow
def test_the_first_model_does_the_same_in_virtual_time() -> None:
    in_virtual_time = FIRST.program.replace("for_s=3.0", 'for_s=3.0, clock="virtual"')
    assert in_virtual_time != FIRST.program
    assert printed(in_virtual_time) == FIRST.output


def test_the_first_model_has_fifteen_lines_at_most() -> None:
    assert lines_of_code(FIRST.program) <= 15


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("example", OTHERS)
def test_every_other_model_prints_what_the_page_says(example: Example) -> None:
    assert printed(example.program) == example.output


@pytest.mark.slow
@pytest.mark.parametrize("example", WITH_ROBOTS)
def test_every_robot_does_what_the_page_says(example: Example) -> None:
    assert printed(example.program) == example.output


def test_every_program_with_a_text_after_it_is_run() -> None:
    assert (len(OTHERS), len(WITH_ROBOTS)) == (2, 7)


@pytest.mark.slow
def test_the_sweep_of_the_page_prints_what_it_says() -> None:
    assert printed(SWEEP.program) == SWEEP.output


@dataclass(frozen=True)
class Place:
    """A value with parts."""

    x: float
    turns: tuple[int, int]


class Walker(Atomic):
    """Sends where it is each second."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.place = self.out_port("place", Place)
        self.pace = self.in_port("pace", float)
        self._x = 0.0
        self._pace = 1.0

    def initialize(self) -> None:
        """Begin."""
        self.hold_in("walking", SECOND)

    def output(self) -> None:
        """Say where it is."""
        self.place.send(Place(self._x, (1, 2)))

    def internal(self) -> None:
        """Go on."""
        self._x += self._pace
        self.hold_in("walking", SECOND)

    def external(self, elapsed: int) -> None:
        """Walk at another pace."""
        self._pace = self.pace[-1]
        self.continue_(elapsed)


def walk() -> Coupled:
    model = Coupled("walk")
    walker = model.add(Walker("walker"))
    model.couple(model.in_port("pace", float), walker.pace)
    return model


def test_a_port_has_what_passed_it_since_it_was_asked_for() -> None:
    model = walk()
    with open_model(model, clock="virtual") as run:
        run.run(1.0)
        place, pace = run.port("walker.place"), run.port("pace")
        assert repr(place) == "<PortValues walker.place: no Place since 1 s>"
        run.plan(2.5, model.in_ports["pace"], 3.0)
        run.run(3.0)
        assert run.port("walker.place") is place
    assert place.times_s() == [2.0, 3.0, 4.0]
    assert place.times_ns() == [2 * SECOND, 3 * SECOND, 4 * SECOND]
    assert [each.x for each in place.values()] == [1.0, 2.0, 5.0]
    assert (pace.times_s(), pace.values()) == ([2.5], [3.0])
    assert repr(place) == "<PortValues walker.place: 3 of Place, 2 s to 4 s>"


@pytest.mark.slow
def test_a_data_frame_has_a_column_for_each_part() -> None:
    model = walk()
    with open_model(model, clock="virtual") as run:
        place, pace = run.port("walker.place"), run.port("pace")
        run.post(model.in_ports["pace"], 2.0)
        run.run(2.0)
    frame = place.to_dataframe()
    assert frame.index.name == "t_s"
    assert list(frame.columns) == ["x", "turns.0", "turns.1"]
    assert frame["x"].tolist() == [0.0, 2.0]
    assert pace.to_dataframe()["value"].tolist() == [2.0]


def _without(*names: str) -> Callable[[str], ModuleType]:
    """What imports modules where these are not installed."""

    def importing(name: str) -> ModuleType:
        if name in names:
            raise ModuleNotFoundError(name=name)
        return import_module(name)

    return importing


@pytest.mark.slow
def test_without_pandas_it_is_a_table_of_pyarrow_and_without_either_a_sentence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(port_values, "import_module", _without("pandas"))
    with open_model(walk(), clock="virtual") as run:
        place = run.port("walker.place")
        run.run(2.0)
    assert place.to_dataframe().to_pydict() == {
        "t_ns": [SECOND, 2 * SECOND],
        "t_s": [1.0, 2.0],
        "x": [0.0, 1.0],
        "turns.0": [1, 1],
        "turns.1": [2, 2],
    }
    monkeypatch.setattr(port_values, "import_module", _without("pandas", "pyarrow"))
    with pytest.raises(ConfigError, match="neither pandas nor pyarrow") as refused:
        place.to_dataframe()
    assert install_command("pandas") in str(refused.value)


@pytest.mark.slow
def test_a_name_that_there_is_not_is_answered_with_the_nearest() -> None:
    with open_board("tachobot", doubles=True, clock="virtual") as robot:
        yaw = robot.port("controller.yaw.command_n")
        robot.run(3.0)
        model = robot.model
        for look, sentence in (
            (lambda: robot.port("controller.yaw.comand_n"), "controller.yaw.command_n?"),
            (lambda: model.components["controler"], "no component 'controler' (did you mean "),
            (lambda: model.components["imu"].out_ports["sampel"], "no port 'sampel' (did you mean"),
            (lambda: model.in_ports["yaw"], "expected one of yaw_reference"),
            (lambda: robot.statistics.models["imo"], "no model 'imo' (did you mean imu?)"),
        ):
            with pytest.raises(UnknownName) as unknown:
                look()
            assert sentence in str(unknown.value)
            assert isinstance(unknown.value, KeyError | FirmwareRuntimeError)
        assert len(yaw) == len(yaw.values()) > 100
        assert repr(robot) == "<OpenBoard tachobot: open, at 3 s>"
        assert repr(model.components["imu"]).endswith(" imu>")
        assert repr(robot.statistics).startswith("<Figures of ")
        assert len(repr(robot.statistics)) < 150
    assert repr(robot) == "<OpenBoard tachobot: over, at 3 s>"
