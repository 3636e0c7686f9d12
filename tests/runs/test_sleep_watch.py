"""A machine that sleeps while a run is armed on it: CLOCK_BOOTTIME goes on, CLOCK_MONOTONIC not."""

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs import supervision
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.supervision import SleepWatch, watch_sleep
from tests.support.periodic_models import Robot


class Rig:
    """A run that never begins, armed, on a machine that sleeps when it is told to."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.asleep = 0
        self.now = 10 * SECOND
        patch.setattr(supervision, "monotonic_ns", lambda: self.now)
        patch.setattr(supervision, "clock_gettime_ns", lambda _clock: self.now + self.asleep)
        self.logged: list[str] = []
        self.executive = Executive(Robot(), MonotonicClock(), list, Configuration())
        permission = Permission(at_start=False, demand_guard=False)
        self.arming = Arming(self.executive, permission, list, log=self.logged.append)
        self.watch = SleepWatch(self.arming)
        assert self.arming.request(0) == []

    def go_on(self, asleep: int) -> None:
        """Sleep for so long, then come to the next pass of the loop."""
        self.now += SECOND
        self.asleep += asleep
        self.watch.between_steps(self.now, 0)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(monkeypatch)


def test_a_run_on_a_machine_that_stays_awake_stays_armed(rig: Rig) -> None:
    for _ in range(3):
        rig.go_on(asleep=0)
    assert rig.arming.interlock()


def test_a_run_whose_machine_slept_is_disarmed_until_it_is_armed_again(rig: Rig) -> None:
    rig.go_on(asleep=90 * SECOND)
    assert not rig.arming.interlock()
    assert rig.logged[-1] == "disarmed: the machine slept for 90.0 s"
    assert rig.arming.request(0) == []
    rig.go_on(asleep=0)
    assert rig.arming.interlock()


def test_a_sleep_while_it_was_disarmed_counts_for_nothing_later(rig: Rig) -> None:
    rig.arming.disarm("by request")
    rig.go_on(asleep=90 * SECOND)
    assert rig.arming.request(0) == []
    rig.go_on(asleep=0)
    assert rig.arming.interlock()


@pytest.mark.parametrize(
    ("clock", "free", "watched"),
    [
        (MonotonicClock(), False, True),
        (MonotonicClock(), True, False),
        (VirtualClock(), False, False),
    ],
)
def test_it_is_watched_where_something_may_be_hurt(
    clock: Clock, *, free: bool, watched: bool
) -> None:
    executive = Executive(Robot(), clock, list, Configuration())
    permission = Permission(at_start=False, demand_guard=False, free=free)
    watch_sleep(executive, Arming(executive, permission, list))
    assert any(isinstance(each, SleepWatch) for each in executive.hooks) is watched


def test_the_clocks_of_this_machine_stay_together_while_it_is_awake() -> None:
    before = supervision._slept()
    assert abs(supervision._slept() - before) < SECOND
