"""A device that was never ready makes a run that ended a run that failed, with the cause."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.statistics.file_header import RunState
from tests.support.executives import Run


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


def run_of(*models: Sensor, stop: str | None = None, until: int = 2 * SECOND) -> Outcome:
    root = Coupled("robot")
    for model in models:
        root.add(model)
    run = Run(root, VirtualClock())
    if stop is not None:
        faults = models[-1].fault_out
        run.executive.simulator.listen(faults, lambda _at, _fault: run.executive.request_stop(stop))
    return run.until(until)


def test_one_that_was_ready_for_a_while_is_enough() -> None:
    assert run_of(Sensor("imu", up_after=SECOND // 2)).state is RunState.ENDED


def test_one_that_never_was_ready_fails_the_run_and_is_named_with_its_cause() -> None:
    sensor = Sensor("imu", sentence="the robot moved")
    outcome = run_of(sensor, Sensor("compass", up_after=0))
    assert outcome.state is RunState.FAILED
    assert outcome.error is None
    for part in ("imu", "never ready", "is not up yet", "the robot moved"):
        assert part in outcome.reason
    assert "compass" not in outcome.reason


def test_a_run_too_short_for_its_devices_says_so() -> None:
    outcome = run_of(Sensor("imu", up_after=5 * SECOND))
    assert outcome.state is RunState.FAILED
    assert "is not up yet" in outcome.reason


def test_all_of_them_are_named() -> None:
    outcome = run_of(Sensor("imu"), Sensor("compass"))
    assert "imu" in outcome.reason
    assert "compass" in outcome.reason


def test_a_stop_while_devices_come_up_is_a_stop() -> None:
    bell = Sensor("bell", up_after=0, sentence="ding")
    outcome = run_of(Sensor("imu"), bell, stop="SIGINT")
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGINT")


def test_a_stop_of_a_run_whose_device_failed_all_along_is_a_failure() -> None:
    outcome = run_of(Sensor("imu", sentence="the robot moved"), stop="SIGTERM")
    assert outcome.state is RunState.FAILED
    assert "the robot moved" in outcome.reason
    assert "SIGTERM" in outcome.reason


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


class Doubtful(Sensor):
    """Up at once; says of itself how many uses have failed, none of which was good."""

    def __init__(self, name: str, failed: int, sentence: str = "no echo") -> None:
        super().__init__(name, up_after=0, sentence=sentence)
        self.failed = failed

    def failed_uses(self) -> int:
        return self.failed


def test_one_that_came_up_and_failed_in_every_use_fails_the_run() -> None:
    outcome = run_of(Doubtful("sonar", failed=86), Sensor("imu", up_after=0))
    assert outcome.state is RunState.FAILED
    assert outcome.reason == "sonar failed 86 of 86 times: no echo"


def test_one_that_failed_twice_may_have_been_about_to_work() -> None:
    assert run_of(Doubtful("sonar", failed=2)).state is RunState.ENDED


def test_one_that_was_never_ready_is_said_to_be_that_alone() -> None:
    sensor = Doubtful("sonar", failed=86)
    sensor.up_after = NEVER
    outcome = run_of(sensor)
    assert "sonar was never ready: it is not up yet" in outcome.reason
    assert "86" not in outcome.reason
