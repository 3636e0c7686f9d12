"""The head, whole, on its doubles in virtual time."""

from collections.abc import Callable, Iterator

import pytest
from pan_tilt.rig import PanTiltRig

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.session import Session
from sim_doubles.faults import FaultScript, NackAddress

EYES = 0x48


class Robot:
    """The head on its doubles, with overrides of board.toml."""

    def __init__(self, *assignments: str) -> None:
        board = registry.load("pan_tilt", assignments)
        self.session = Session(board, VirtualClock(), doubles=True, statistics_path=None)
        assert isinstance(self.session.rig, PanTiltRig)
        self.rig = self.session.rig

    def run(self, until_s: float) -> dict[str, object]:
        """Run up to an instant, in s, and return how it ended; then all outputs are off."""
        outcome = self.session.executive.run(round(until_s * SECOND))
        assert outcome.error is None
        assert self.rig.outputs == {"servos": 0}
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


@pytest.mark.parametrize("azimuth_rad", [-1.2, -0.4, 0.0, 0.9, 1.2])
@pytest.mark.parametrize("elevation_rad", [-0.3, 0.6])
def test_it_looks_at_a_light_wherever_it_is(
    robot: Build, azimuth_rad: float, elevation_rad: float
) -> None:
    where = f"world.azimuth_rad={azimuth_rad}", f"world.elevation_rad={elevation_rad}"
    head = robot(*where, "world.swing_rad=0.0")
    ended = head.run(5.0)
    assert ended["error_rad"] == pytest.approx(0.0, abs=0.1)
    assert ended["on_target"] is True
    assert head.rig.pwm.warnings == []
    assert head.rig.adc.warnings == []


def test_a_light_that_swings_is_followed(robot: Build) -> None:
    assert robot().run(15.0)["on_target"] is True


def test_in_the_dark_it_searches_to_and_fro(robot: Build) -> None:
    head = robot("world.shines_from_s=100.0")
    assert head.run(5.0)["following"] is False
    assert abs(head.rig.pan.angle_rad(5 * SECOND)) > 0.5


def test_a_light_that_goes_out_is_searched_for(robot: Build) -> None:
    assert robot("world.shines_until_s=3.0").run(6.0)["following"] is False


def test_eyes_that_fall_silent_leave_the_head_where_it_looks(robot: Build) -> None:
    head = robot("world.swing_rad=0.0")
    silent = NackAddress(address=EYES, times=None, since=3 * SECOND)
    head.rig.buses["i2c1"].faults = FaultScript([silent])
    assert head.run(6.0)["error_rad"] == pytest.approx(0.0, abs=0.1)


def test_runs_are_equal(robot: Build) -> None:
    assert robot().run(4.0) == robot().run(4.0)


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("eyes.full_scale_v=3.3", "eyes.full_scale_v"),
        ("eyes.period_s=0.001", "eyes.period_s"),
        ("servos.tilt.channel=0", "servos.channel"),
        ("servos.pan.least_rad=2.0", "servos.pan.least_rad"),
        ("servos.address=0x48", "servos.address"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(assignment: str, key: str) -> None:
    with pytest.raises(ConfigError) as refused:
        registry.load("pan_tilt", [assignment])
    assert any(fault.startswith(key) for fault in refused.value.faults)
