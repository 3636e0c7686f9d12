"""The head, whole, on its doubles in virtual time."""

import pytest

from firmware_runtime import SECOND, ConfigError, open_board
from firmware_runtime.board import registry
from sim_doubles.faults import FaultScript, NackAddress

EYES = 0x48
STILL = {"world.swing_rad": 0.0}


@pytest.mark.parametrize("azimuth_rad", [-1.2, -0.4, 0.0, 1.2])
@pytest.mark.parametrize("elevation_rad", [-0.3, 0.6])
def test_it_looks_at_a_light_wherever_it_is(azimuth_rad: float, elevation_rad: float) -> None:
    there = {"world.azimuth_rad": azimuth_rad, "world.elevation_rad": elevation_rad}
    with open_board("pan_tilt", doubles=True, clock="virtual", set=STILL | there) as robot:
        robot.run(5.0)
        assert robot.result["on_target"] is True
        assert robot.rig.pwm.warnings == []
        assert robot.rig.adc.warnings == []


def test_it_sees_as_well_by_a_driver_that_was_written_for_circuitpython() -> None:
    pytest.importorskip("adafruit_ads1x15", reason="adafruit-circuitpython-ads1x15 is missing")
    eyes = {"eyes.driver": "adafruit"}
    with open_board("pan_tilt", doubles=True, clock="virtual", set=STILL | eyes) as robot:
        robot.run(5.0)
        assert robot.result["on_target"] is True
        assert robot.statistics.bus["i2c1"].errors == 0


def test_a_light_that_swings_is_followed() -> None:
    with open_board("pan_tilt", doubles=True, clock="virtual") as robot:
        robot.run(8.0)
        assert robot.result["on_target"] is True


def test_its_bus_is_as_busy_as_its_board_file_says() -> None:
    with open_board("pan_tilt", doubles=True, clock="virtual") as robot:
        bus = robot.rig.buses["i2c1"]
        robot.run(1.0)
        before = bus.bits
        robot.run(5.0)
        load = registry.load("pan_tilt").loads["i2c1"]
        assert (bus.bits - before) / load.bus_hz / 5.0 == pytest.approx(load.utilisation, rel=0.02)


def test_in_the_dark_it_searches_to_and_fro() -> None:
    dark = {"world.shines_from_s": 100.0}
    with open_board("pan_tilt", doubles=True, clock="virtual", set=dark) as robot:
        robot.run(5.0)
        assert robot.result["following"] is False
        assert abs(robot.rig.pan.angle_rad(robot.now)) > 0.5


def test_a_light_that_goes_out_is_searched_for() -> None:
    brief = {"world.shines_until_s": 3.0}
    with open_board("pan_tilt", doubles=True, clock="virtual", set=brief) as robot:
        robot.run(3.0)
        assert robot.result["following"] is True
        robot.run(3.0)
        assert robot.result["following"] is False


def test_eyes_that_fall_silent_leave_the_head_where_it_looks() -> None:
    with open_board("pan_tilt", doubles=True, clock="virtual", set=STILL) as robot:
        robot.run(3.0)
        before = robot.rig.pan.angle_rad(robot.now)
        silent = NackAddress(address=EYES, times=None, since=3 * SECOND)
        robot.rig.buses["i2c1"].faults = FaultScript([silent])
        robot.run(3.0)
        assert robot.rig.pan.angle_rad(robot.now) == pytest.approx(before, abs=0.05)


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
