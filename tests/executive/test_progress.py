"""Whether logical time keeps up with the clock, and what becomes of a run in which it does not."""

from time import monotonic_ns

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.progress import Progress
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import HEARTBEAT
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

MAX_LAG = Configuration().max_lag
LIVELOCK_AT = 100 * MILLISECOND


class Hurrying(Sampler):
    """A sampler that from an instant on comes back after next to no time."""

    def __init__(self, name: str, advance: int) -> None:
        super().__init__(name, NEVER)
        self.advance = advance

    def initialize(self) -> None:
        self.hold_in("waiting", LIVELOCK_AT)

    def internal(self) -> None:
        self.work(self.activations)
        self.activations += 1
        self.hold_in("hurrying", self.advance)


class HurriedRobot(Coupled):
    """An IMU at its usual rate beside a model without any."""

    def __init__(self, advance: int) -> None:
        super().__init__("robot")
        self.imu = self.add(Sampler("imu"))
        self.hurrying = self.add(Hurrying("hurrying", advance))


@pytest.mark.parametrize("advance", [1, 20 * MICROSECOND])
def test_a_model_with_more_events_than_can_be_worked_off_ends_the_run_and_is_named(
    advance: int,
) -> None:
    robot, clock = HurriedRobot(advance), StallingClock()
    robot.hurrying.work = lambda _number: clock.spend(40 * MICROSECOND)
    run = Run(robot, clock)
    outcome = run.until(10 * SECOND)
    assert outcome.state is RunState.OVERRUN
    assert "hurrying ran most" in outcome.reason
    assert f"{MAX_LAG / SECOND:g} s" in outcome.reason
    assert run.made_safe == 2
    assert run.counts("imu")[0] == clock.now() // PERIOD + 1  # what was due by the clock
    assert LIVELOCK_AT + MAX_LAG < clock.now() < LIVELOCK_AT + MAX_LAG + MILLISECOND


@pytest.mark.parametrize("clock", [MonotonicClock(), ScaledClock(3)])
def test_a_livelock_ends_in_real_time_too(clock: Clock) -> None:
    run = Run(HurriedRobot(1), clock, Configuration(max_lag=20 * MILLISECOND))
    assert run.until(60 * SECOND).state is RunState.OVERRUN
    assert run.executive.progress.keeps_up == (run.executive.progress.lag <= 20 * MILLISECOND)


def test_virtual_time_is_never_behind_whatever_a_model_does() -> None:
    run = Run(HurriedRobot(1), VirtualClock())
    assert run.until(LIVELOCK_AT + 10_000).state is RunState.ENDED


def test_catching_up_with_a_long_stall_is_no_livelock() -> None:
    robot, clock = Robot(), StallingClock({10: 20 * SECOND})
    robot.imu.work = lambda _number: clock.spend(9 * MILLISECOND)
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    assert run.until(60 * SECOND).state is RunState.ENDED
    assert run.counts("imu")[2] == 0


def test_a_bus_that_hangs_for_seconds_is_no_livelock() -> None:
    robot, clock = Robot(), StallingClock()
    robot.imu.work = lambda number: clock.spend(25 * MILLISECOND if number < 90 else 0)
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    assert run.until(30 * SECOND).state is RunState.ENDED


def test_a_stall_while_behind_counts_as_one_step() -> None:
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock({10: 2 * SECOND})
    robot.thrust.work = lambda value: clock.spend(2 * SECOND) if value == 10 else None
    run = Run(robot, clock)
    assert run.until(20 * SECOND).state is RunState.ENDED


class Followed:
    """A `Progress` and the lags that it saw."""

    def __init__(self, speed: float = 1) -> None:
        step = Step(lambda: 0)
        step.join(Atomic("model"))
        self.progress = Progress(step, 10 * MILLISECOND, speed)


def test_the_lag_is_the_time_since_the_next_event_was_due_in_real_time() -> None:
    for speed, lag in ((1, 300), (2, 150), (0.5, 600)):
        progress = Followed(speed).progress
        assert progress.note(1000, 1000) == 0
        assert progress.note(2000, 1700) == progress.lag == lag
        assert progress.note(3000, 3001) == progress.lag == 0


def test_before_logical_time_has_caught_up_once_a_step_that_ends_is_a_sign_of_life() -> None:
    progress = Followed().progress
    assert progress.note(SECOND, 1) == 0
    assert progress.keeps_up
    progress.note(2 * SECOND, 3 * SECOND)
    assert progress.note(4 * SECOND, 3 * SECOND) == SECOND
    assert not progress.keeps_up


def test_the_heartbeat_is_the_instant_up_to_which_logical_time_has_caught_up() -> None:
    robot, clock = Robot(), StallingClock({10: 1000 * SECOND})
    run = Run(robot, clock, Configuration(policies={"imu": ActivationPolicy("catch-up")}))
    behind_s: list[int] = []

    def look(number: int) -> None:
        if number > 0:
            behind_s.append((monotonic_ns() - run.executive.cells[HEARTBEAT]) // SECOND)

    robot.imu.work = look
    run.until(SECOND)
    assert behind_s[:10] == [0] * 10
    assert all(990 < each < 1010 for each in behind_s[10:])


def test_arming_is_no_sign_of_life() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(PERIOD)
    before = run.executive.cells[HEARTBEAT]
    run.executive.arm(armed=False, epoch=3)
    assert run.executive.cells[HEARTBEAT] == before > 0
