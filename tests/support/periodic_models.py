"""Small models for tests of the executive, and an executive around them."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER

PERIOD = 10 * MILLISECOND


class Sampler(Atomic):
    """Sends its activation's number every period; `work(number)` is called in the transition.

    An input of n moves the next activation to n ns from now; a negative one leaves it alone. What
    was left of the waiting when inputs came is kept in `left`.
    """

    def __init__(self, name: str, period: int = PERIOD, offset: int = 0) -> None:
        super().__init__(name)
        self.period = period
        self.offset = offset
        self.activations = 0
        self.left: list[int] = []
        self.work: Callable[[int], None] = lambda _number: None
        self.replanned: Callable[[], None] = lambda: None
        self.replan = self.in_port("replan", int)
        self.sample = self.out_port("sample", int)

    def initialize(self) -> None:
        self.hold_in("waiting", self.offset)

    def output(self) -> None:
        self.sample.send(self.activations)

    def internal(self) -> None:
        self.work(self.activations)
        self.activations += 1
        self.hold_in("waiting", self.period)

    def external(self, elapsed: int) -> None:
        self.continue_(elapsed)
        self.left.append(self.sigma)
        for delay in self.replan:
            if delay >= 0:
                self.hold_in("waiting", delay)
        self.replanned()


class Actuator(Atomic):
    """Keeps what it received and when; `work(value)` is called in the transition."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.received: list[int] = []
        self.exits = 0
        self.work: Callable[[int], None] = lambda _value: None
        self.command = self.in_port("command", int)

    def external(self, elapsed: int) -> None:
        self.continue_(elapsed)
        for value in self.command:
            self.received.append(value)
            self.work(value)

    def exit(self) -> None:
        self.exits += 1


class Robot(Coupled):
    """Samplers `imu` and `compass`, an actuator that follows the first, and outside inputs."""

    def __init__(self, imu: int = PERIOD, compass: int = NEVER) -> None:
        super().__init__("robot")
        self.command = self.in_port("command", int)
        self.replanned: Callable[[], None] = lambda: None
        self.replan = self.in_port("replan", int)
        self.imu = self.add(Sampler("imu", imu))
        self.thrust = self.add(Actuator("thrust"))
        self.couple(self.imu.sample, self.thrust.command)
        self.couple(self.command, self.thrust.command)
        self.couple(self.replan, self.imu.replan)
        if compass != NEVER:
            self.compass = self.add(Sampler("compass", compass))
