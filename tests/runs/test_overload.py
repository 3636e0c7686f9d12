"""A loop that has no time left: what it gives up, and how others see it."""

from collections.abc import Iterator
from typing import Any

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs import supervision
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.supervision import WINDOW, Overload, Policy
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import STEP_TIME
from firmware_runtime.statistics.summary import summary
from tests.support.periodic_models import Robot


class Time:
    """Real time and processor time, as a test moves them."""

    def __init__(self) -> None:
        self.real = SECOND
        self.processor = 0


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    now = Time()
    monkeypatch.setattr(supervision, "monotonic_ns", lambda: now.real)
    monkeypatch.setattr(supervision, "process_time_ns", lambda: now.processor)
    return now


class Rig:
    """A run that never begins, and what its overload does to it."""

    def __init__(self, time: Time, policy: Policy = "yield") -> None:
        self.time = time
        self.reported: list[str] = []
        self.executive = Executive(Robot(), MonotonicClock(), list, Configuration())
        permission = Permission(at_start=False, demand_guard=False)
        self.arming = Arming(self.executive, permission, list)
        self.watch = Overload(self.executive, 90.0, policy, self.arming, self.reported.append)
        self.watch.between_steps(0, 0)

    def pass_window(self, steps: float, processor: float = 0.0) -> None:
        """Let a window pass with these shares of it in steps, and in processor time."""
        self.time.real += WINDOW
        self.time.processor += round(processor * WINDOW)
        self.executive.cells[STEP_TIME] += round(steps * WINDOW)
        self.watch.between_steps(self.time.real - SECOND, 0)

    @property
    def run(self) -> dict[str, Any]:
        found: dict[str, Any] = self.executive.statistics.as_json()["conditions"]["run"]
        return found


@pytest.fixture
def fifo(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """As if SCHED_FIFO were held; what is given up is noted."""
    given_up: list[str] = []
    module = "firmware_runtime.executive.process"
    monkeypatch.setattr(f"{module}.holds_priority", lambda: not given_up)
    monkeypatch.setattr(f"{module}.give_up_priority", lambda: given_up.append("SCHED_FIFO"))
    return given_up  # type: ignore[return-value]


def test_a_load_below_the_limit_is_not_logged(time: Time) -> None:
    rig = Rig(time)
    for _ in range(5):
        rig.pass_window(steps=0.89, processor=0.89)
    assert rig.reported == []
    assert rig.run["overloaded_s"] is None


@pytest.mark.parametrize(("steps", "processor"), [(0.95, 0.1), (0.1, 0.95)])
def test_steps_without_a_pause_and_processor_time_are_a_load_each(
    time: Time, steps: float, processor: float
) -> None:
    rig = Rig(time)
    rig.pass_window(steps, processor)
    assert "95 % of the last 3 s" in rig.reported[0]
    assert "max_load_percent = 90" in rig.reported[0]


def test_it_is_judged_over_whole_windows_and_logged_once(time: Time) -> None:
    rig = Rig(time)
    rig.executive.cells[STEP_TIME] += 2 * SECOND
    time.real += WINDOW - MILLISECOND
    rig.watch.between_steps(0, 0)
    assert rig.reported == []
    for _ in range(3):
        rig.pass_window(steps=1.0)
    assert len(rig.reported) == 1


def test_a_process_that_was_stopped_in_the_middle_of_a_step_is_not_overloaded(time: Time) -> None:
    rig = Rig(time)
    time.real += 100 * WINDOW
    rig.pass_window(steps=101.0)
    assert rig.reported == []
    rig.pass_window(steps=1.0)
    assert len(rig.reported) == 1


def test_priority_is_given_up_and_an_armed_run_disarmed(time: Time, fifo: list[str]) -> None:
    rig = Rig(time)
    rig.arming.request(0)
    rig.pass_window(steps=1.0)
    assert fifo == ["SCHED_FIFO"]
    assert not rig.arming.armed
    assert rig.arming.reason.startswith("overload: 100 %")
    assert "gives up SCHED_FIFO" in rig.reported[0]
    assert rig.run["overloaded_s"] > 0
    assert summary(rig.executive.statistics.figures()).endswith(" overloaded disarmed")


def test_without_priority_to_give_up_the_run_stays_armed_and_says_so(time: Time) -> None:
    rig = Rig(time)
    rig.arming.request(0)
    rig.pass_window(steps=1.0)
    assert rig.arming.armed
    assert "has no SCHED_FIFO to give up" in rig.reported[0]


def test_a_run_may_end_instead_which_is_no_requested_stop(time: Time, fifo: list[str]) -> None:
    rig = Rig(time, "stop")
    rig.pass_window(steps=1.0)
    outcome: Outcome = rig.executive.run(SECOND)
    assert outcome.state is RunState.OVERRUN
    assert outcome.reason.startswith("overload: 100 %")
    assert fifo == []
