"""What a run in real time leaves of the causes; on another clock it leaves none."""

from collections.abc import Callable, Sequence
from unittest.mock import Mock

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock, S
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.statistics.blame import CAUSES
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


class QuickClock(MonotonicClock):
    """Real time by its kind; a wait is over at once, the 30th much too late."""

    def __init__(self) -> None:
        super().__init__()
        self.waits = 0

    def source(self) -> tuple[Callable[[], int], int]:
        return self.now, 0  # it starts anew with each wait

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:  # noqa: ARG002
        self.waits += 1
        self.start(until + 50 * MILLISECOND * (self.waits == 30))
        return []


def test_a_late_step_has_a_verdict_and_is_counted_by_its_cause() -> None:
    run = Run(Robot(), QuickClock())
    run.until(60 * PERIOD)
    figures = run.figures()
    worst = figures.worst[0]
    assert worst.lateness_us >= 50_000
    assert worst.blame is not None
    assert worst.blame.cause in CAUSES
    assert worst.blame.of_us >= 50_000
    counted = figures.late_by_cause
    assert counted is not None
    assert counted[worst.blame.cause] >= 1


def test_what_was_on_time_has_none() -> None:
    run = Run(Robot(), QuickClock())
    run.until(20 * PERIOD)
    on_time = [each for each in run.figures().worst if each.lateness_us + each.step_us < 1000]
    assert on_time
    assert all(each.blame is None for each in on_time)


def test_a_clock_that_is_not_the_machines_has_no_causes() -> None:
    run = Run(Robot(), StallingClock({5: 25 * MILLISECOND}))
    run.until(SECOND)
    assert run.figures().late_by_cause == {}
    assert all("blame" not in each for each in run.json()["worst"])


def counters_of(run: Run) -> object:
    """What its blamer has open."""
    blamer = run.executive._ledger.late._blamer
    assert blamer is not None
    return blamer._counters


def test_what_a_run_takes_to_begin_is_no_usual_steps_time() -> None:
    tap = Mock(instrument=lambda _, functions: functions)
    tap.exit = lambda exit_models: exit_models()
    run = Run(Robot(), QuickClock(), Configuration(tap=tap))
    opened = []
    tap.go_on = lambda _: opened.append(counters_of(run))
    run.executive.run_on(20 * PERIOD)
    run.executive.run_on(40 * PERIOD)
    run.executive.end()
    assert opened == [None, None]


@pytest.mark.parametrize("pauses", [(), (20, 40)])
def test_counters_are_closed_at_every_pause_and_opened_again(pauses: tuple[int, ...]) -> None:
    run = Run(Robot(), QuickClock())
    for steps in pauses:
        run.executive.run_on(steps * PERIOD)
        assert counters_of(run) is None
    run.executive.run_on(60 * PERIOD)
    run.executive.end()
    assert counters_of(run) is None
    assert run.figures().worst[0].blame is not None
