"""The search finds the highest rate, the split adds up, and certainty is not overstated."""

import argparse
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.loop import bench as loop
from benchmarks.loop import split as loop_split
from benchmarks.loop.rates import (
    HIGHEST_HZ,
    LOWEST_HZ,
    assignments,
    causes,
    highest,
    highest_share,
    needed,
    outcome,
)
from benchmarks.loop.split import KINDS, Stopwatch
from benchmarks.loop.text import loop_lines
from benchmarks.shared.process import LoopError, tachobot
from firmware_runtime.board import registry
from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError

# The search ---------------------------------------------------------------------------------------


class Machine:
    """Holds every rate up to a limit; `tried` has the rates it was asked for."""

    def __init__(self, limit_hz: int) -> None:
        self.limit_hz = limit_hz
        self.tried: list[int] = []

    def __call__(self, rate_hz: int) -> dict[str, Any]:
        self.tried.append(rate_hz)
        return {"rate_hz": rate_hz, "holds": rate_hz <= self.limit_hz}


@pytest.mark.parametrize(
    ("limit_hz", "tried"),
    [
        (2000, [999]),
        (700, [999, 500, 749, 624]),
        (499, [999, 500, 200, 350, 425]),
        (40, [999, 500, 200, 100, 50]),
    ],
)
def test_rates_are_tried_from_the_highest_down_and_then_between_two(
    limit_hz: int, tried: list[int]
) -> None:
    machine = Machine(limit_hz)
    found = highest((50, 100, 200, 500, 999), machine, refinements=2)
    assert machine.tried == tried
    assert [each["rate_hz"] for each in found] == sorted(tried)


@pytest.mark.parametrize("rate_hz", [LOWEST_HZ, *loop.RATES, 125, 501, HIGHEST_HZ])
def test_the_board_takes_every_rate_that_the_bench_offers(rate_hz: int) -> None:
    board = registry.load("tachobot", assignments(rate_hz))
    assert round(1 / board.settings.controller.period_s) == rate_hz


@pytest.mark.parametrize("rate_hz", [LOWEST_HZ - 1, HIGHEST_HZ + 1])
def test_the_board_takes_none_beyond_them(rate_hz: int) -> None:
    with pytest.raises(ConfigError):
        registry.load("tachobot", assignments(rate_hz))
    with pytest.raises(argparse.ArgumentTypeError, match=f"{rate_hz} Hz: expected 40 to 999"):
        loop.rates(f"100,{rate_hz}")


def test_rates_are_whole_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert loop.rates("50,100") == (50, 100)
    with pytest.raises(SystemExit) as exit_:
        main(["bench", "loop", "--rates", "fast"])
    assert exit_.value.code == 2
    assert "--rates: 'fast': expected a whole number" in capsys.readouterr().err


def statistics(**counters: int) -> dict[str, Any]:
    """Statistics of a run without anything but its counters."""
    nothing = {"lateness_us": {}, "step_us": {}, "worst": [], "conditions": {"scheduler": "?"}}
    return {"scheduled": 0, "run": 0, "overruns": 0, **nothing, **counters}


def test_what_was_dropped_is_late_too() -> None:
    found = outcome(statistics(scheduled=1000, run=990, overruns=5))
    assert (found["activations"], found["late"], found["dropped"]) == (1000, 15, 10)
    assert found["at_most"] == highest_share(15, 1000)


@pytest.mark.parametrize(("overruns", "holds"), [(0, True), (1, True), (2, False)])
def test_a_rate_holds_with_fewer_than_one_in_ten_thousand_late(
    overruns: int, *, holds: bool
) -> None:
    found = outcome(statistics(scheduled=20_000, run=20_000, overruns=overruns))
    assert found["holds"] == holds


def test_a_run_without_activations_says_nothing() -> None:
    with pytest.raises(LoopError, match="no activation"):
        outcome(statistics())


def test_an_activation_was_woken_late_if_most_of_its_lateness_was_the_systems() -> None:
    def entry(lateness_us: float, wake_us: float) -> dict[str, Any]:
        return {"model": "imu", "lateness_us": lateness_us, "causes": {"wake_us": wake_us}}

    worst = [entry(900.0, 890.0), entry(900.0, 100.0), entry(90.0, 90.0)]  # the last is not late
    found = causes({"worst": worst, "models": {"imu": {"tolerance_us": 100.0}}})
    assert found == {"late_by_system": 1, "late_by_us": 1}


# Certainty ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("late", "mean"), [(0, 2.9957), (1, 4.7439), (3, 7.7537), (10, 16.9622), (100, 118.08)]
)
def test_the_bound_is_that_of_the_tables(late: int, mean: float) -> None:
    assert highest_share(late, 10**6) * 10**6 == pytest.approx(mean, rel=1e-3)


@pytest.mark.slow
@given(late=st.integers(0, 60), of=st.integers(1, 10**6))
def test_the_bound_is_above_what_was_seen_and_a_share(late: int, of: int) -> None:
    assert min(late / of, 1) <= highest_share(late, of) <= 1
    assert highest_share(late, of) <= highest_share(late + 1, of)


def test_as_many_as_are_needed_just_show_it() -> None:
    count = needed(1e-4)
    assert highest_share(0, count) <= 1e-4 < highest_share(0, count - 1)


# The split ----------------------------------------------------------------------------------------


class Ticking:
    """A clock that goes on by one with every look."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        self.now += 1
        return self.now


class Chip:
    """Calls what is below it."""

    def __init__(self, below: Callable[[], int]) -> None:
        self._below = below

    def read(self) -> int:
        return self._below() + 1


def test_the_parts_add_up_to_the_time_that_passed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Ticking()
    monkeypatch.setattr(loop_split, "monotonic_ns", clock)
    watch = Stopwatch("runtime")
    bus = Chip(lambda: 40)
    watch.watch(bus, "double", "read")
    driver = Chip(bus.read)
    watch.watch(driver, "driver", "read")
    began = clock.now
    assert driver.read() == 42
    assert dict(watch.spent) == {"runtime": 1, "driver": 2, "double": 1}
    assert sum(watch.spent.values()) == clock.now - began
    watch.clear()
    assert not watch.spent


def test_an_error_leaves_the_watch_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop_split, "monotonic_ns", Ticking())
    watch = Stopwatch("runtime")
    driver = Chip(lambda: 1 // 0)
    watch.watch(driver, "driver", "read")
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            driver.read()
    assert dict(watch.spent) == {"runtime": 2, "driver": 2}


def test_the_wire_is_computed_from_the_boards_own_load() -> None:
    board = registry.load("tachobot")
    found = loop.wire(board.loads["i2c1"])
    assert found["us"] / 1e6 * 100 == pytest.approx(board.loads["i2c1"].utilisation)
    assert found["us"] * found["full_at_hz"] == pytest.approx(1e6)
    too_fast = assignments(math.ceil(found["refused_above_hz"]))
    own_speed = [each for each in too_fast if "speed_hz" not in each]
    with pytest.raises(ConfigError, match="above 80 % is refused"):
        registry.load("tachobot", own_speed)


# The command --------------------------------------------------------------------------------------

QUICK = ("--rates", "999", "--activations", "999", "--repetitions", "1", "--split-seconds", "1")


@pytest.mark.real_time
def test_the_report_adds_up_and_the_ratio_comes_last(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "loop", *QUICK, "--json", "--save", str(tmp_path)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "loop.json").read_text()) == report
    assert list(report)[-1] == "ratio"
    (split,) = report["split"]
    assert sum(split["us"].values()) == pytest.approx(sum(split["kinds_us"].values()))
    assert min(split["kinds_us"][kind] for kind in KINDS) > 0
    assert 0 < split["busy"] <= 1
    (tried,) = report["rates"]
    assert 0 <= tried["dropped"] <= tried["late"] <= tried["activations"]
    assert tried["holds"] == (tried["late"] == 0)
    assert report["ratio"] == (9.99 if tried["holds"] else 0)
    lines = list(loop_lines(report))
    assert lines[-1].startswith(f"ratio {report['ratio']:.2f}")
    assert any("computed, not measured" in line for line in lines)


@pytest.mark.slow
def test_a_run_that_cannot_begin_says_why(tmp_path: Path) -> None:
    with (
        tachobot(tmp_path, 1.0, ["controller.period_s=9"]) as running,
        pytest.raises(LoopError, match=r"controller\.period_s"),
    ):
        running.read_when(lambda _statistics: True)
