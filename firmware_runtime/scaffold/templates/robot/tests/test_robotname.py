"""The robot, whole, on its doubles in virtual time."""

from collections.abc import Callable, Iterator

import pytest

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.session import Session
from sim_doubles.faults import FaultScript, NackAddress

from robotname.rig import RobotNameRig

SONAR = 0x71


class Robot:
    """The robot on its doubles, with overrides of board.toml."""

    def __init__(self, *assignments: str) -> None:
        board = registry.load("robotname", assignments)
        self.session = Session(board, VirtualClock(), doubles=True, statistics_path=None)
        assert isinstance(self.session.rig, RobotNameRig)
        self.rig = self.session.rig

    def run(self, until_s: float) -> dict[str, object]:
        """Run up to an instant, in s, and return how it ended; then all outputs are off."""
        outcome = self.session.executive.run(round(until_s * SECOND))
        assert outcome.error is None
        assert self.rig.outputs == {"motor": 0}
        return self.session.result()


Build = Callable[..., Robot]


@pytest.fixture
def robot() -> Iterator[Build]:
    """Build robots that are closed at the end."""
    built: list[Robot] = []

    def build(*assignments: str) -> Robot:
        built.append(Robot(*assignments))
        return built[-1]

    yield build
    for each in built:
        each.session.close()


@pytest.mark.parametrize("start_m", [0.2, 0.5, 2.0, 2.9])
def test_it_stops_at_its_distance_from_the_wall(robot: Build, start_m: float) -> None:
    rover = robot(f"world.start_m={start_m}")
    assert rover.run(20.0) == {"distance_m": pytest.approx(0.5, abs=0.03), "settled": True}
    assert rover.rig.pwm.warnings == []
    assert rover.rig.sonar.warnings == []


def test_it_waits_where_no_wall_is_within_range(robot: Build) -> None:
    rover = robot("world.start_m=8.0")
    assert rover.run(3.0) == {"distance_m": 8.0, "settled": False}


def test_a_sonar_that_falls_silent_on_the_way_stops_it(robot: Build) -> None:
    rover = robot()
    silent = NackAddress(address=SONAR, times=None, since=1 * SECOND)
    rover.rig.buses["i2c1"].faults = FaultScript([silent])
    assert rover.run(20.0) == {"distance_m": pytest.approx(1.5, abs=0.3), "settled": False}
    assert rover.rig.world.speed_m_s == pytest.approx(0.0, abs=1e-6)
