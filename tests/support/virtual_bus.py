"""One accounted bus of doubles in virtual time, and models on it, without an executive."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.hal.accounted_bus import AccountedBus
from sim_doubles.clock import FollowingClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target

T = TypeVar("T")
D = TypeVar("D", bound=Target)


class VirtualBus:
    """Doubles on the clock of a simulator that is made when the models are there."""

    def __init__(self) -> None:
        self._simulator: Simulator | None = None
        self._entries: dict[InPort[Any], InPort[Any]] = {}
        self.clock = FollowingClock(lambda: self._simulator.now if self._simulator else 0)
        self.doubles = I2cBusDouble("i2c1", self.clock, [], reach=self.clock.reach)
        self.bus = AccountedBus(self.doubles, 400_000, time=self.clock)

    def connect(self, make: Callable[..., D], **settings: object) -> D:
        """Wire a double to the bus."""
        double = make(self.clock, **settings)
        self.doubles.connect(double)
        return double

    def simulate(self, models: Iterable[Atomic], *ports: OutPort[Any]) -> list[tuple[int, Any]]:
        """Put models on the bus; return what leaves the ports from now on."""
        robot = Coupled("robot")
        for model in models:
            robot.add(model)
            for entry in model.in_ports.values():
                self._entries[entry] = robot.in_port(entry.name, entry.type)
                robot.couple(self._entries[entry], entry)
        self._simulator = Simulator(robot)
        return self.listen(*ports)

    def listen(self, *ports: OutPort[Any]) -> list[tuple[int, Any]]:
        """Return what leaves these ports from now on."""
        assert self._simulator is not None
        received: list[tuple[int, Any]] = []
        for port in ports:
            self._simulator.listen(port, lambda at, value: received.append((at, value)))
        return received

    def send(self, port: InPort[T], value: T, at: int) -> None:
        """Let a value arrive at a model's port at an instant."""
        assert self._simulator is not None
        self._simulator.inject(self._entries[port], value)
        self._simulator.advance(at)

    def run(self, until: int) -> None:
        assert self._simulator is not None
        self._simulator.run(until)
