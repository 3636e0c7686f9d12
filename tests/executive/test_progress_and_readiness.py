"""Devices that come up, and logical time that keeps up with the clock."""

from time import monotonic_ns

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.progress import Progress
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ACKNOWLEDGED, ARMED, HEARTBEAT
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock


class Sensor(Atomic):
    """Up after some time, for a second; with a sentence it reports a fault every 0.1 s until then.

    `looked_at` counts how often it was asked whether it works.
    """

    def __init__(self, name: str, up_after: int = NEVER, sentence: str = "") -> None:
        super().__init__(name)
        self.fault_out = self.out_port("fault", Fault)
        self.up_after = up_after
        self.sentence = sentence
        self.age = 0
        self.looked_at = 0

    def unready(self) -> str | None:
        self.looked_at += 1
        return None if 0 <= self.age - self.up_after < SECOND else "is not up yet"

    def initialize(self) -> None:
        self.hold_in("coming up", SECOND // 10)

    def output(self) -> None:
        if self.sentence:
            self.fault_out.send(Fault("NotReady", self.sentence, 1))

    def internal(self) -> None:
        self.age += self.sigma
        self.hold_in("coming up", SECOND // 10)


NEVER_READY = ["imu", "never ready", "is not up yet", "moved"]


class Doubtful(Sensor):
    """Up at once; says of itself how many uses have failed, none of which was good."""

    def __init__(self, name: str, failed: int, up_after: int = 0) -> None:
        super().__init__(name, up_after, sentence="no echo")
        self.failed = failed

    def failed_uses(self) -> int:
        return self.failed


def run_of(*models: Sensor, stop: str | None = None, until: int = 2 * SECOND) -> Outcome:
    root = Coupled("robot")
    for model in models:
        root.add(model)
    run = Run(root, VirtualClock())
    if stop is not None:
        faults = models[-1].fault_out
        run.executive.simulator.listen(faults, lambda _at, _fault: run.executive.request_stop(stop))
    return run.until(until)


def test_a_stop_while_devices_come_up_is_a_stop() -> None:
    bell = Sensor("bell", up_after=0, sentence="ding")
    outcome = run_of(Sensor("imu"), bell, stop="SIGINT")
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGINT")


@pytest.mark.parametrize(
    ("models", "said", "not_said"),
    [
        ([Sensor("imu", sentence="moved"), Sensor("compass", 0)], NEVER_READY, "compass"),
        ([Sensor("imu", 5 * SECOND)], ["is not up yet"], "moved"),
        ([Sensor("imu"), Sensor("compass")], ["imu", "compass"], "moved"),
        (
            [Doubtful("sonar", 86), Sensor("imu", 0)],
            ["sonar failed 86 of 86 times: no echo"],
            "imu",
        ),
        ([Doubtful("sonar", 86, up_after=NEVER)], ["sonar was never ready: it is not up"], "86"),
    ],
    ids=["never", "too short", "all", "failed in every use", "never ready alone"],
)
def test_a_device_that_does_not_work_fails_the_run_and_is_named_with_its_cause(
    models: list[Sensor], said: list[str], not_said: str
) -> None:
    outcome = run_of(*models)
    assert (outcome.state, outcome.error) == (RunState.FAILED, None)
    assert [each for each in said if each not in outcome.reason] == []
    assert not_said not in outcome.reason


@pytest.mark.parametrize("model", [Sensor("imu", SECOND // 2), Doubtful("sonar", failed=2)])
def test_a_device_that_worked_for_a_while_or_failed_twice_may_be_sound(model: Sensor) -> None:
    assert run_of(model).state is RunState.ENDED


def test_a_stop_of_a_run_whose_device_failed_all_along_is_a_failure() -> None:
    outcome = run_of(Sensor("imu", sentence="the robot moved"), stop="SIGTERM")
    assert outcome.state is RunState.FAILED
    assert [each for each in ("the robot moved", "SIGTERM") if each not in outcome.reason] == []


class Visitor:
    """None of the model's: there from an instant on, whether or not anything is due then."""

    path = "visitor"

    def __init__(self, clock: VirtualClock, comes_at: int) -> None:
        self.clock = clock
        self.comes_at = comes_at

    def unready(self) -> str | None:
        return None if self.clock.now() >= self.comes_at else "has not come"


@pytest.mark.parametrize(
    ("comes_at", "state"),
    [(1050 * MILLISECOND, RunState.ENDED), (1051 * MILLISECOND, RunState.FAILED)],
)
def test_a_device_that_is_ready_in_the_last_instant_of_a_run_has_not_failed(
    comes_at: int, state: RunState
) -> None:
    clock = VirtualClock()
    run = Run(Sensor("imu", 0), clock)
    run.executive.readiness.require(Visitor(clock, comes_at))
    assert run.until(1050 * MILLISECOND).state is state


def test_once_all_were_ready_none_is_looked_at_again() -> None:
    sensor = Sensor("imu", up_after=SECOND)
    run_of(sensor, until=100 * SECOND)
    assert sensor.looked_at < 15


def test_what_failed_for_another_reason_keeps_that() -> None:
    class Broken(Sensor):
        def internal(self) -> None:
            raise OSError("gone")

    outcome = run_of(Broken("imu"))
    assert isinstance(outcome.error, Exception)
    assert "never ready" not in outcome.reason


def test_a_device_that_cannot_say_whether_it_works_fails_the_run() -> None:
    class Mute(Sensor):
        def unready(self) -> str | None:
            if self.age > SECOND:
                raise ValueError("no answer")
            return "is not up yet"

    outcome = run_of(Mute("imu"))
    assert outcome.state is RunState.FAILED
    assert "no answer" in outcome.reason


def test_a_device_that_quits_as_it_is_judged_keeps_no_run_from_its_end() -> None:
    class Quitting(Sensor):
        def unready(self) -> str | None:
            if self.age >= SECOND:
                raise SystemExit(3)
            return "is not up yet"

    run = Run(Quitting("imu"), VirtualClock())
    with pytest.raises(SystemExit):
        run.until(SECOND)
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["state"] == "failed"


def test_what_failed_first_is_the_reason_where_a_device_then_cannot_say_whether_it_works() -> None:
    class Gone(Sensor):
        def unready(self) -> str | None:
            if self.age > 0:
                raise ValueError("no answer")
            return "is not up yet"

        def internal(self) -> None:
            self.age = SECOND
            raise OSError("gone")

    outcome = run_of(Gone("imu"))
    assert outcome.reason.endswith("gone")
    assert outcome.error is not None
    assert outcome.reason == str(outcome.error)


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


@pytest.mark.parametrize("speed", [1, 2, 0.5])
def test_as_long_a_real_time_behind_ends_a_run_at_any_speed(speed: float) -> None:
    progress = Followed(speed).progress
    progress.note(0, 0)
    for half_tenth in range(1, 203):  # 10 ms from the first of them
        assert progress.livelock == ""
        progress.note(round(half_tenth * 50 * MICROSECOND * speed), 0)
    assert "0.01 s of stepping" in progress.livelock


def test_a_second_stall_while_a_loop_catches_up_with_the_first_is_no_livelock() -> None:
    """What was stepped before it, with less lag from window to window, is not added to it."""
    progress, now = Followed().progress, 0
    progress.note(0, 0)
    for lag_ms in (*range(1000, 700, -1), 1200, 1190):
        now += 100 * MICROSECOND
        progress.note(now, now - lag_ms * MILLISECOND)
    assert progress.livelock == ""


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


def test_a_run_that_is_armed_as_it_begins_has_acknowledged_no_takeover() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.run_on(PERIOD)
    assert (run.executive.cells[ARMED], run.executive.cells[ACKNOWLEDGED]) == (1, 0)


def test_a_run_that_is_not_to_be_armed_as_it_begins_is_not() -> None:
    run = Run(Robot(), VirtualClock(), Configuration(armed_at_start=False))
    run.executive.run_on(PERIOD)
    assert run.executive.cells[ARMED] == 0


def test_a_run_that_was_disarmed_goes_on_so_after_a_pause() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.run_on(PERIOD)
    run.executive.arm(armed=False, epoch=3)
    run.executive.run_on(2 * PERIOD)
    assert (run.executive.cells[ARMED], run.executive.cells[ACKNOWLEDGED]) == (0, 3)


def test_arming_is_no_sign_of_life() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(PERIOD)
    before = run.executive.cells[HEARTBEAT]
    run.executive.arm(armed=False, epoch=3)
    assert run.executive.cells[HEARTBEAT] == before > 0
