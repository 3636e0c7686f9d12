"""The detective robot, whole, on its doubles in virtual time, for tests."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firmware_boards.detective.wiring import DetectiveRobot

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Ending, Lines, Robot
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.accounted_bus import ONE_ATTEMPT, AccountedBus
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.clock import FollowingClock
from sim_doubles.rigs.detective import DetectiveRig

LONGEST_S = 200
NEAR = ("--set", "world.target=[-0.6, 0.35]")
"""A target that it searches, turns to, drives to and reaches within 6 s of real time."""


@dataclass
class VirtualDetective:
    """A robot under way; `endings` and `faults` are what it said."""

    rig: DetectiveRig
    robot: Robot
    simulator: Simulator
    endings: list[tuple[int, Ending]] = field(default_factory=list)
    faults: list[tuple[int, Fault]] = field(default_factory=list)

    @property
    def model(self) -> DetectiveRobot:
        assert isinstance(self.robot.model, DetectiveRobot)
        return self.robot.model

    def run(self, until_s: float) -> None:
        self.simulator.run(round(until_s * SECOND))

    def run_mission(self, longest_s: int = LONGEST_S) -> dict[str, Any]:
        """Run until it says it is over, or for so long; return how it ended."""
        for second in range(1 + self.simulator.now // SECOND, longest_s):
            self.run(second)
            if self.endings:
                break
        return self.rig.result(self.simulator.now, self.robot.result())

    def are_treads_still(self) -> bool:
        return not any(self.rig.motors.speeds_rad_s(self.simulator.now))


def virtual_detective(*assignments: str, board: str | Path = "detective") -> VirtualDetective:
    """Build one with `KEY=VALUE` overrides."""
    loaded = registry.load(str(board), assignments)
    clock: list[Simulator] = []
    wire = FollowingClock(lambda: clock[0].now if clock else 0)
    rig = DetectiveRig(loaded.settings, wire)
    buses = {
        name: AccountedBus(bus, 400_000, ONE_ATTEMPT, time=wire) for name, bus in rig.buses.items()
    }
    ports = {name: AccountedPort(port, 9600, wire) for name, port in rig.ports.items()}
    robot = loaded.build(Lines(buses, ports))
    robot.find_chips()
    rig.attach(robot.model)
    clock.append(Simulator(robot.model))
    built = VirtualDetective(rig, robot, clock[0])
    built.simulator.listen(
        built.model.mission.ended, lambda at, ending: built.endings.append((at, ending))
    )
    for atomic in built.simulator.atomics:
        if "fault" in atomic.out_ports:
            built.simulator.listen(
                atomic.out_ports["fault"], lambda at, fault: built.faults.append((at, fault))
            )
    return built


def target_at(bearing_deg: float, distance_m: float) -> str:
    """The override that puts the target at a bearing from north, as seen from the start."""
    bearing = math.radians(bearing_deg)
    return f"world.target=[{distance_m * math.sin(bearing)}, {distance_m * math.cos(bearing)}]"
