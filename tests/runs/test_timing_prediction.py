"""Predicted ends of steps, from the statistics of runs on a computer of known times."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from msgspec.structs import replace

from benchmarks.prediction.machine import Machine, Runs
from firmware_runtime.board import registry
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs import timing_prediction
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.timing_prediction import (
    LEAST_STEPS,
    Prediction,
    TimedStep,
    predicted,
    timetable,
)
from firmware_runtime.statistics.file import save
from firmware_runtime.statistics.histogram import Histogram, empty_cells
from firmware_runtime.statistics.layout import STEP_HISTOGRAM
from firmware_runtime.statistics.statistics import Statistics
from tests.support.command import Command

MACHINE = 7
SLOW_BUS = "buses.i2c1.speed_hz=200000"


@pytest.fixture(scope="module")
def recorded() -> Statistics:
    """Statistics of TachoBot on its doubles, on a seeded computer."""
    return Runs(registry.load("tachobot"), Machine(MACHINE), 1, 1200, wires=False).statistics


def with_conditions(recorded: Statistics, conditions: Mapping[str, object]) -> Statistics:
    header = replace(recorded.header, conditions={**recorded.header.conditions, **conditions})
    return replace(recorded, header=header)


@pytest.mark.slow
def test_a_timetable_has_each_tick_with_its_models_and_its_time_on_the_wire() -> None:
    board = registry.load("tachobot")
    own = {below_root(each.path) for each in with_all_below(board.unconnected().model)}
    steps = [each for each in timetable(board, own) if "thrust_pairs" in each.models]
    ticks = [each for each in steps if "imu" in each.models]
    assert {each.at % (10 * MILLISECOND) for each in ticks} == {0}
    assert ticks[-1].models == tuple(sorted(own & set(ticks[-1].models)))
    assert ticks[-1].wire_ns == pytest.approx(1_362_500, rel=0.01)  # by performance.md


@pytest.mark.slow
@pytest.mark.parametrize("settings", [[SLOW_BUS], ["controller.period_s=0.02"]])
def test_what_is_predicted_is_not_exceeded(recorded: Statistics, settings: list[str]) -> None:
    board = registry.load("tachobot", settings)
    bound = predicted(board, recorded)
    run = Runs(board, Machine(MACHINE), 2, 1200, wires=True)
    # one in a thousand is one of these steps: by chance it may be some more
    assert bound.response_ns >= run.exceeded_by(0.005)
    assert bound.warning() is None
    assert bound.unrecorded == []


@pytest.mark.slow
def test_own_times_of_a_run_on_chips_hold_the_wire_already(recorded: Statistics) -> None:
    board = registry.load("tachobot")
    chips = with_conditions(recorded, {"switched_off": ["/dev/i2c-1 0x40: fd10"]})
    served = with_conditions(recorded, {"switched_off": ["/run/doubles i2c1 0x40: fd10"]})
    on_chips = predicted(board, chips).response_ns
    assert predicted(board, served).response_ns > on_chips + MILLISECOND
    slower = registry.load("tachobot", [SLOW_BUS])
    assert predicted(slower, chips).response_ns > on_chips + MILLISECOND


@pytest.fixture(scope="module")
def brief() -> Statistics:
    return Runs(registry.load("tachobot"), Machine(MACHINE), 1, 1, wires=False).statistics


@pytest.fixture
def quick(brief: Statistics, monkeypatch: pytest.MonkeyPatch) -> Statistics:
    """Statistics of few steps, which are enough for a prediction of a few."""
    few = {"LEAST_STEPS": 500, "TIMETABLE": 20, "STRETCH": SECOND // 5, "DRAWN": 100}
    for name, number in few.items():
        monkeypatch.setattr(timing_prediction, name, number)
    return brief


def with_steps(recorded: Statistics, took: int, steps: int = LEAST_STEPS) -> Statistics:
    """The same but for its steps, each of which took so long."""
    histogram = Histogram(empty_cells())
    for _ in range(steps):
        histogram.record(took)
    cells = memoryview(bytearray(recorded.cells)).cast("q")
    cells[STEP_HISTOGRAM] = histogram.cells
    return replace(recorded, cells=cells)


def test_what_steps_took_longer_than_their_models_is_added(quick: Statistics) -> None:
    board = registry.load("tachobot")

    def bound(took: int) -> int:
        return predicted(board, with_steps(quick, took)).response_ns

    at_once = bound(1)
    assert bound(100 * MICROSECOND) == at_once, "its models alone take longer"
    slower = bound(60 * MILLISECOND) - bound(50 * MILLISECOND)
    assert slower == pytest.approx(timing_prediction.MARGIN * 10 * MILLISECOND)


def test_one_activation_that_was_late_among_thousands_is_not_the_lateness_that_is_stated(
    quick: Statistics,
) -> None:
    cells = memoryview(bytearray(quick.cells)).cast("q")
    late = Histogram(cells[quick.layout.lateness(0)])
    for _ in range(2000):
        late.record(MILLISECOND)
    late.record(SECOND)
    stated = predicted(registry.load("tachobot"), replace(quick, cells=cells)).lateness_ns
    assert MILLISECOND <= stated < 2 * MILLISECOND


def test_the_least_steps_are_enough_and_one_less_is_not(quick: Statistics) -> None:
    board, least = registry.load("tachobot"), timing_prediction.LEAST_STEPS
    assert predicted(board, with_steps(quick, 1, least)).response_ns > 0
    with pytest.raises(ConfigError, match=f"of {least - 1} steps; expected {least} or more"):
        predicted(board, with_steps(quick, 1, least - 1))


@pytest.mark.usefixtures("quick")
def test_a_step_of_a_timetable_has_the_time_on_the_wire_that_it_takes_itself() -> None:
    steps = {each.at: each for each in timetable(registry.load("tachobot"), {"imu"})}
    resets, waits = steps[10 * MILLISECOND], steps[20 * MILLISECOND]
    assert resets.wire_ns > waits.wire_ns == 0


def test_the_period_of_a_prediction_is_the_shortest_of_a_model(quick: Statistics) -> None:
    board = registry.load("tachobot")
    assert predicted(board, quick).period_ns == seconds(board.settings.controller.period_s)


def test_a_prediction_has_a_margin(quick: Statistics, monkeypatch: pytest.MonkeyPatch) -> None:
    board = registry.load("tachobot")
    stated = predicted(board, quick).response_ns
    monkeypatch.setattr(timing_prediction, "MARGIN", 2 * timing_prediction.MARGIN)
    assert predicted(board, quick).response_ns == pytest.approx(2 * stated)


def always(took: int) -> timing_prediction._Samples:
    histogram = Histogram(empty_cells())
    histogram.record(took)
    return timing_prediction._Samples(histogram)


def test_a_step_begins_when_it_is_due_and_the_one_before_it_is_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    steps = [TimedStep(0, ("imu", "pid"), 200), TimedStep(1000, ("pid",), 0)]
    steps.append(TimedStep(90_000, ("pid",), 0))
    times = {"imu": always(3000), "pid": always(500)}
    monkeypatch.setattr(timing_prediction, "DRAWN", 4)
    responses = list(timing_prediction._responses(steps, times, always(10), 0.5))
    assert responses == 2 * [(3610, 3500), (3110, 500), (510, 500)]
    assert timing_prediction._exceeded_by_few(range(4000)) == 3997


@pytest.mark.parametrize(
    ("period_ns", "warns"), [(None, False), (11, False), (10, False), (9, True)]
)
def test_a_prediction_warns_of_steps_that_last_longer_than_a_period(
    period_ns: int | None, *, warns: bool
) -> None:
    found = Prediction(10, lateness_ns=1, wire_ns=1, period_ns=period_ns, unrecorded=[])
    assert (found.warning() is not None) is warns


def test_statistics_of_virtual_time_predict_nothing() -> None:
    board = registry.load("tachobot")
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    session.run(10 * MILLISECOND)
    session.close()
    with pytest.raises(ConfigError, match="virtual time, in which nothing lasts"):
        predicted(board, session.executive.statistics)


@pytest.mark.slow
def test_few_steps_and_another_robots_predict_nothing(recorded: Statistics) -> None:
    few = Runs(registry.load("tachobot"), Machine(MACHINE), 1, 1, wires=False).statistics
    with pytest.raises(ConfigError, match=f"expected {LEAST_STEPS} or more"):
        predicted(registry.load("tachobot"), few)
    with pytest.raises(ConfigError, match="expected a run of detective"):
        predicted(registry.load("detective"), recorded)


@pytest.mark.slow
def test_check_says_what_a_file_predicts(
    command: Command, tmp_path: Path, recorded: Statistics
) -> None:
    path = tmp_path / "run.stats"
    save(recorded, path)
    said = command("check", "tachobot", "--from", str(path)).out
    assert "predicted: 999 of 1000 steps are over " in said
    quick = ("--set", "imu.sample_hz=1000", "--set", "controller.period_s=0.002")

    said = command("check", "tachobot", "--from", str(path), *quick).out
    assert "warning: steps are predicted to be over" in said


def test_check_refuses_what_is_no_statistics_file(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_text("board = 'tachobot'\n")
    ended = command("check", "tachobot", "--from", str(path))
    assert (ended.status, ended.out) == (2, "")
    assert "not a whole statistics file" in ended.error
