"""Small models for tests of the kernel, and a way to see what they send."""

from collections.abc import Callable
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.time import NEVER
from firmware_runtime.devs.trace import trace


class Clock(Atomic):
    """Sends 0, 1, 2... every `period`, for the first time after `offset`."""

    def __init__(self, name: str, period: int, offset: int | None = None) -> None:
        super().__init__(name)
        self.period = period
        self.offset = period if offset is None else offset
        self.count = 0
        self.ticks = self.out_port("ticks", int)

    def initialize(self) -> None:
        self.hold_in("ticking", self.offset)

    def output(self) -> None:
        self.ticks.send(self.count)

    def internal(self) -> None:
        self.count += 1
        self.hold_in("ticking", self.period)


class Log(Atomic):
    """Keeps every bag it gets, with the time elapsed since the one before; passive from then on."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.values = self.in_port("values", int)
        self.bags: list[list[int]] = []
        self.elapsed: list[int] = []

    def external(self, elapsed: int) -> None:
        self.bags.append(list(self.values))
        self.elapsed.append(elapsed)


class Echo(Atomic):
    """Sends each bag's values on, `delay` later; what arrives meanwhile joins them."""

    def __init__(self, name: str, delay: int = 0) -> None:
        super().__init__(name)
        self.delay = delay
        self.held: list[int] = []
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)

    def output(self) -> None:
        for value in self.held:
            self.outlet.send(value)

    def internal(self) -> None:
        self.held = []
        self.passivate()

    def external(self, elapsed: int) -> None:
        self.held = [*self.held, *self.inlet]
        if self.phase == "passive":
            self.hold_in("holding", self.delay)
        else:
            self.continue_(elapsed)


class Scripted(Atomic):
    """Does what the test says: functions to call in output, internal and external transitions.

    What was called is kept in `calls`, with the elapsed time of external ones.
    """

    def __init__(self, name: str, sigma: int = NEVER) -> None:
        super().__init__(name)
        self.first_sigma = sigma
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)
        self.calls: list[tuple[str, int]] = []
        self.on_output: Callable[[], None] = lambda: None
        self.on_internal: Callable[[], None] = self.passivate
        self.on_external: Callable[[int], None] = self.continue_

    def initialize(self) -> None:
        self.sigma = self.first_sigma

    def output(self) -> None:
        self.on_output()

    def internal(self) -> None:
        self.calls.append(("internal", 0))
        self.on_internal()

    def external(self, elapsed: int) -> None:
        self.calls.append(("external", elapsed))
        self.on_external(elapsed)


def top(*components: Atomic | Coupled) -> Coupled:
    """A coupled model named `top` that holds these."""
    model = Coupled("top")
    for component in components:
        model.add(component)
    return model


def traced(simulator: Engine, until: int) -> list[tuple[int, str, Any]]:
    """What all ports sent in a run up to `until`: instant, path, value."""
    messages: list[tuple[int, str, Any]] = []
    trace(simulator, lambda at, path, value: messages.append((at, path, value)))
    simulator.run(until)
    return messages
