"""The robot, whole, on its doubles in virtual time."""

from collections.abc import Callable, Iterator

import pytest
from balancing.rig import BalancingRig
from balancing.wiring import Balancing

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.session import Session
from sim_doubles.faults import FaultScript, NackAddress

IMU, WHEELS = 0x68, 0x40


class Robot:
    """The robot on its doubles, with overrides of board.toml."""

    def __init__(self, *assignments: str) -> None:
        board = registry.load("balancing", assignments)
        self.session = Session(board, VirtualClock(), doubles=True, statistics_path=None)
        assert isinstance(self.session.rig, BalancingRig)
        assert isinstance(self.session.robot.model, Balancing)
        self.rig, self.model = self.session.rig, self.session.robot.model

    def run(self, until_s: float) -> dict[str, object]:
        """Run up to an instant, in s, and return how it ended; then all outputs are off."""
        outcome = self.session.executive.run(round(until_s * SECOND))
        assert outcome.error is None
        assert self.rig.outputs == {"wheels": 0}
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


@pytest.mark.parametrize("start_rad", [-0.1, 0.0, 0.05, 0.1])
def test_it_stands_where_it_was_let_go(robot: Build, start_rad: float) -> None:
    balancing = robot(f"world.start_pitch_rad={start_rad}")
    ended = balancing.run(6.0)
    assert ended["standing"] is True
    assert abs(balancing.rig.world.place_m) < 1.0
    assert balancing.rig.pwm.warnings == []
    assert balancing.rig.imu.warnings == []


def test_wheels_that_are_mounted_the_other_way_round_turn_the_other_way(robot: Build) -> None:
    assert robot("wheels.right.is_reversed=true").run(4.0)["standing"] is True


def test_without_its_motors_it_falls(robot: Build) -> None:
    balancing = robot("controller.max_drive=0.001")
    assert balancing.run(4.0)["standing"] is False
    assert balancing.rig.world.has_fallen


def test_lying_it_leaves_the_motors_alone(robot: Build) -> None:
    balancing = robot("world.start_pitch_rad=1.2", "world.held_s=10.0")
    balancing.run(3.0)
    assert balancing.rig.pwm.duties == (0.0,) * 16
    assert balancing.model.controller.mode.phase == "Lying"


def test_an_imu_that_falls_silent_switches_the_motors_off(robot: Build) -> None:
    balancing = robot()
    silent = NackAddress(address=IMU, times=None, since=3 * SECOND)
    balancing.rig.buses["i2c1"].faults = FaultScript([silent])
    balancing.run(6.0)
    assert balancing.rig.world.has_fallen
    assert balancing.model.left.commanded == 0.0


def test_runs_are_equal(robot: Build) -> None:
    assert robot().run(3.0) == robot().run(3.0)


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("wheels.right.pwm_channel=8", "wheels.right"),
        ("imu.sample_hz=100", "imu.sample_hz"),
        ("wheels.address=0x68", "wheels.address"),
        ("controller.period_s=1", "controller.period_s"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(assignment: str, key: str) -> None:
    with pytest.raises(ConfigError) as refused:
        registry.load("balancing", [assignment])
    assert any(fault.startswith(key) for fault in refused.value.faults)
