"""When the counters are read in a run, and which steps pass for slow."""

from collections.abc import Callable

import pytest

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.executive.blame import blamer
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.late_steps import RESERVE
from firmware_runtime.statistics.blame import Blame
from firmware_runtime.system.thread_counters import Reading
from tests.support.counters import Counters
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


class ArrangedClock(StallingClock, MonotonicClock):
    """One whose stalls are arranged, and which passes for the machine's: counters are read."""

    overdue_at = 0

    def source(self) -> tuple[Callable[[], int], int]:
        return self.now, 0


class Rig:
    """A robot in such a time, and the instants, ms, at which counters were read."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        stalls: dict[int, int],
        robot: Robot | None = None,
    ) -> None:
        self.counters = Counters()
        self.read_at: list[int] = []
        self.clock = ArrangedClock(stalls)
        self.robot = robot or Robot()
        read = self.counters.read

        def noted() -> Reading:
            self.read_at.append(self.clock.instant // MILLISECOND)
            return read()

        monkeypatch.setattr(self.counters, "read", noted)
        monkeypatch.setattr(blamer, "ThreadCounters", lambda: self.counters)
        self.run = Run(self.robot, self.clock)

    def blame(self) -> Blame:
        """Why the worst activation was late."""
        found = self.run.figures().worst[0].blame
        assert found is not None
        return found


def test_counters_are_read_as_a_run_begins_soon_after_each_second_and_after_a_late_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch, {30: 5 * MILLISECOND})
    rig.run.until(2500 * MILLISECOND)
    assert rig.read_at == [0, 100, 305, 1000, 2000]


def test_a_reading_for_which_there_was_no_time_is_made_up_for_soon(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = Robot(compass=40 * MILLISECOND)
    robot.compass.offset = 20 * MILLISECOND + RESERVE - 1  # it is due then just after 100 ms
    rig = Rig(monkeypatch, {}, robot)
    rig.run.until(500 * MILLISECOND)
    assert rig.read_at == [0, 150]


@pytest.mark.parametrize(("spent_us", "others_us"), [(350, 0), (351, 251), (1000, 900)])
def test_a_step_on_time_that_took_longer_by_a_quarter_of_what_is_tolerated_is_slow(
    monkeypatch: pytest.MonkeyPatch, spent_us: int, others_us: int
) -> None:
    rig = Rig(monkeypatch, {30: 5 * MILLISECOND})
    rig.robot.imu.work = lambda number: rig.clock.spend(
        (spent_us if number == 20 else 100) * MICROSECOND
    )
    rig.run.until(SECOND // 2)
    assert rig.blame().evidence["others_us"] == others_us


@pytest.mark.parametrize("behind_us", [0, 900])
def test_a_late_step_behind_another_has_had_of_what_was_counted_what_it_took_beyond_the_usual(
    monkeypatch: pytest.MonkeyPatch, behind_us: int
) -> None:
    behind = behind_us * MICROSECOND
    robot = Robot(compass=PERIOD)
    robot.compass.offset = MILLISECOND
    rig = Rig(monkeypatch, {}, robot)
    robot.imu.work = lambda number: rig.clock.spend(3 * MILLISECOND if number == 20 else 0)
    robot.compass.work = lambda number: rig.clock.spend(behind if number == 20 else 0)
    rig.run.until(SECOND // 2)
    assert rig.run.model("compass")["overruns"] == 1
    assert rig.blame().evidence["others_us"] == behind_us
