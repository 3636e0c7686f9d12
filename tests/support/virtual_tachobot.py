"""TachoBot, whole, on its doubles in virtual time, for tests."""

from dataclasses import dataclass, field
from typing import Any

from firmware_boards.tachobot.wiring import Tachobot

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.clock import FollowingClock
from sim_doubles.rigs.tachobot import TachobotRig


@dataclass
class VirtualTachobot:
    """TachoBot on its doubles in virtual time, with what it said on its ports."""

    rig: TachobotRig
    robot: Robot
    simulator: Simulator
    received: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)

    @property
    def model(self) -> Tachobot:
        assert isinstance(self.robot.model, Tachobot)
        return self.robot.model

    def run(self, until_s: float) -> None:
        self.simulator.run(round(until_s * SECOND))

    def values(self, port: str) -> list[Any]:
        return [value for _at, value in self.received.get(port, [])]

    def faults(self) -> list[Fault]:
        return [
            value for port in self.received if port.endswith("fault") for value in self.values(port)
        ]


def _listen(tachobot: VirtualTachobot) -> None:
    for atomic in tachobot.simulator.atomics:
        for port in atomic.out_ports.values():
            said = tachobot.received.setdefault(port.path.removeprefix("tachobot."), [])
            tachobot.simulator.listen(
                port,
                lambda at, value, said=said: said.append((at, value)),  # type: ignore[misc]
            )


def virtual_tachobot(*assignments: str, checked: bool = False) -> VirtualTachobot:
    """Build one with `KEY=VALUE` overrides; checked mode takes twice the time."""
    board = registry.load("tachobot", assignments)
    clock: list[Simulator] = []
    wire = FollowingClock(lambda: clock[0].now if clock else 0)
    rig = TachobotRig(board.settings, wire)
    buses = {name: AccountedBus(bus, 400_000, time=wire) for name, bus in rig.buses.items()}
    robot = board.build(Lines(buses))
    robot.find_chips()
    rig.attach(robot.model)
    clock.append(Simulator(robot.model, checked=checked))
    built = VirtualTachobot(rig, robot, clock[0])
    _listen(built)
    return built
