"""From a sensor's sample to an actuator's write; one instrument; mistakes of models."""

import sys
from types import FrameType

import pytest

from firmware_runtime import ModelError, Simulator, run
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.functions import FUNCTIONS
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.statistics.run_text import statistics_text
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Actuator, Robot, Sampler
from tests.support.stalling_clock import StallingClock


class Delay(Atomic):
    """Hands on the last value, `span` after the first that it was waiting for."""

    def __init__(self, span: int) -> None:
        super().__init__("delay")
        self.span = span
        self.value = 0
        self.into = self.in_port("into", int)
        self.out = self.out_port("out", int)

    def external(self, elapsed: int) -> None:
        self.continue_(elapsed)
        self.value = self.into[-1]
        if self.sigma == NEVER:
            self.hold_in("delaying", self.span)

    def output(self) -> None:
        self.out.send(self.value)


class DelayedRobot(Coupled):
    """The actuator follows the IMU through a delay."""

    def __init__(self, span: int) -> None:
        super().__init__("robot")
        self.imu = self.add(Sampler("imu"))
        self.delay = self.add(Delay(span))
        self.thrust = self.add(Actuator("thrust"))
        self.couple(self.imu.sample, self.delay.into)
        self.couple(self.delay.out, self.thrust.command)


def misses(run: Run) -> int:
    counted: int = run.json()["deadline_misses"]["yaw"]
    return counted


def within(robot: Robot | DelayedRobot, span: int) -> Configuration:
    return Configuration(deadlines=[PathDeadline("yaw", robot.imu.sample, robot.thrust, span)])


def test_an_answer_in_the_instant_of_the_sample_is_in_time() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock(), within(robot, 1))
    run.until(10 * PERIOD)
    assert misses(run) == 0


@pytest.mark.parametrize(("spent", "missed"), [(300, 0), (301, 1)])
def test_the_time_of_the_actuators_transition_counts(spent: int, missed: int) -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock, within(robot, 300 * MICROSECOND))
    robot.thrust.work = lambda value: clock.spend(spent * MICROSECOND) if value == 3 else None
    run.until(10 * PERIOD)
    assert misses(run) == missed


@pytest.mark.parametrize(("ended_ms", "missed"), [(12, 4), (13, 5)])
def test_a_sample_without_an_answer_is_a_miss_once_its_time_is_over(
    ended_ms: int, missed: int
) -> None:
    robot = DelayedRobot(15 * MILLISECOND)
    run = Run(robot, VirtualClock(), within(robot, 12 * MILLISECOND))
    run.until(10 * PERIOD + ended_ms * MILLISECOND)
    assert misses(run) == missed


def test_the_lateness_of_the_sample_counts() -> None:
    robot = Robot()
    run = Run(robot, StallingClock({4: 400 * MICROSECOND}), within(robot, 300 * MICROSECOND))
    run.until(10 * PERIOD)
    assert misses(run) == 1
    assert run.model("imu")["overruns"] == 0


@pytest.mark.parametrize(
    ("span", "limit", "missed"),
    [
        (5 * MILLISECOND, 5 * MILLISECOND, 0),
        (5 * MILLISECOND, 4 * MILLISECOND, 10),
        (15 * MILLISECOND, 15 * MILLISECOND, 0),
        (15 * MILLISECOND, 12 * MILLISECOND, 4),  # the first answer enables the path
    ],
)
def test_time_in_models_on_the_way_counts(span: int, limit: int, missed: int) -> None:
    robot = DelayedRobot(span)
    run = Run(robot, VirtualClock(), within(robot, limit))
    run.until(10 * PERIOD - 1)
    assert misses(run) == missed


class Gated(Coupled):
    """The actuator follows the IMU through a gate."""

    def __init__(self, open_from: int, shut_from: int) -> None:
        super().__init__("robot")
        self.imu = self.add(Sampler("imu"))
        self.gate = self.add(Gate(open_from, shut_from))
        self.thrust = self.add(Actuator("thrust"))
        self.couple(self.imu.sample, self.gate.into)
        self.couple(self.gate.out, self.thrust.command)


class Gate(Atomic):
    """Passes the values from one on up to another, at once."""

    def __init__(self, open_from: int, shut_from: int) -> None:
        super().__init__("gate")
        self.passed = range(open_from, shut_from)
        self.into = self.in_port("into", int)
        self.out = self.out_port("out", int)
        self.value = 0

    def external(self, elapsed: int) -> None:
        self.value = self.into[-1]
        if self.value in self.passed:
            self.activate()
        else:
            self.continue_(elapsed)

    def output(self) -> None:
        self.out.send(self.value)


def counted_on(robot: Gated) -> dict[str, int]:
    deadline = PathDeadline("yaw", robot.imu.sample, robot.thrust, PERIOD // 2)
    run = Run(robot, VirtualClock(), Configuration(deadlines=[deadline]))
    run.until(10 * PERIOD)
    counted: dict[str, int] = run.json()["deadlines"]["yaw"]
    return counted


@pytest.mark.parametrize("answers", [1, 5])
def test_each_sample_of_a_path_that_is_cut_is_a_miss(answers: int) -> None:
    # that at the very end has not had its time
    assert counted_on(Gated(0, answers)) == {
        "misses": 10 - answers,
        "samples": 11,
        "answers": answers,
    }


def test_a_path_counts_from_its_first_answer_on() -> None:
    assert counted_on(Gated(3, 100)) == {"misses": 0, "samples": 11, "answers": 8}


def test_a_path_that_never_was_enabled_has_samples_and_no_answer() -> None:
    robot = DelayedRobot(NEVER - 1_000 * PERIOD)
    run = Run(robot, VirtualClock(), within(robot, PERIOD // 2))
    run.until(10 * PERIOD)
    assert run.json()["deadlines"]["yaw"] == {"misses": 0, "samples": 11, "answers": 0}
    assert "not enabled" in "\n".join(statistics_text(run.figures()))


def test_a_model_with_a_confluent_function_of_its_own_answers_with_it() -> None:
    class Confluent(Sampler):
        def confluent(self) -> None:
            self.internal()

    robot = Coupled("robot")
    imu = robot.add(Sampler("imu"))
    sink = robot.add(Confluent("sink"))
    robot.couple(imu.sample, sink.replan)
    deadline = PathDeadline("yaw", imu.sample, sink, PERIOD // 2)
    run = Run(robot, VirtualClock(), Configuration(deadlines=[deadline]))
    run.until(10 * PERIOD)
    assert misses(run) == 0


EXECUTIVE = "firmware_runtime.executive."
SIMULATOR = "firmware_runtime.devs.simulator"


def frames_around() -> tuple[str, ...]:
    """The modules of the frames between the simulator and the function that calls this."""
    modules: list[str] = []
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and frame.f_globals["__name__"] != SIMULATOR:
        modules.append(frame.f_globals["__name__"].removeprefix(EXECUTIVE))
        frame = frame.f_back
    return tuple(modules)


class Seen(Atomic):
    """Holds for a period, whatever comes; notes what stands around each of its functions."""

    def __init__(self, period: int) -> None:
        super().__init__("seen")
        self.period = period
        self.into = self.in_port("into", int)
        self.around: dict[str, set[tuple[str, ...]]] = {}

    def initialize(self) -> None:
        self.hold_in("waiting", PERIOD)

    def output(self) -> None:
        self.around.setdefault("output", set()).add(frames_around())

    def internal(self) -> None:
        self.around.setdefault("internal", set()).add(frames_around())
        self.hold_in("waiting", PERIOD)

    def external(self, elapsed: int) -> None:
        self.around.setdefault("external", set()).add(frames_around())
        self.continue_(elapsed)

    def confluent(self) -> None:
        self.around.setdefault("confluent", set()).add(frames_around())
        self.hold_in("waiting", PERIOD)


@pytest.mark.parametrize("period", [PERIOD, NEVER])
def test_nothing_stands_between_the_simulator_and_a_function_of_a_model(period: int) -> None:
    root, seen, sampler = Coupled("root"), Seen(period), Sampler("sampler", 2 * PERIOD // 5)
    root.add(sampler)
    root.add(seen)
    root.couple(sampler.sample, seen.into)
    deadline = PathDeadline("path", sampler.sample, seen, PERIOD)
    watched = Configuration(deadlines=[deadline])
    assert Run(root, StallingClock(), watched).until(10 * PERIOD).error is None
    assert seen.around == {each: {()} for each in FUNCTIONS}


@pytest.mark.parametrize("period", [0, -PERIOD, 0.5])
def test_a_period_that_is_no_time_is_refused(period: int) -> None:
    with pytest.raises(ConfigError):
        Run(Seen(period), VirtualClock())


class Sender(Atomic):
    """Sends a value of another type, or sends in a transition."""

    def __init__(self, name: str, value: object, *, in_transition: bool) -> None:
        super().__init__(name)
        self.out = self.out_port("out", float)
        self.value, self.in_transition = value, in_transition

    def initialize(self) -> None:
        self.hold_in("waiting", 1000)

    def output(self) -> None:
        if not self.in_transition:
            self.out.send(self.value)  # type: ignore[arg-type]

    def internal(self) -> None:
        if self.in_transition:
            self.out.send(1.0)
        self.passivate()


class Taker(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", float)


def mistaken(value: object, *, in_transition: bool = False) -> Coupled:
    top = Coupled("top")
    sender = top.add(Sender("sender", value, in_transition=in_transition))
    top.couple(sender.out, top.add(Taker("taker")).entrance)
    return top


@pytest.mark.parametrize(
    ("value", "in_transition", "what"),
    [
        ("one", False, "top.sender.*port 'out' carries float, not 'one'"),
        (1.0, True, "top.sender.*sent on port 'out' outside its output function"),
    ],
)
def test_a_simulator_and_a_run_in_virtual_time_name_the_mistake(
    value: object, *, in_transition: bool, what: str
) -> None:
    with pytest.raises(ModelError, match=what):
        Simulator(mistaken(value, in_transition=in_transition)).run(2000)
    with pytest.raises(ModelError, match=what):
        run(mistaken(value, in_transition=in_transition), for_s=1e-5, clock="virtual")
