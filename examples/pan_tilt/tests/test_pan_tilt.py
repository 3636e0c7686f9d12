"""The head, whole, on its doubles in virtual time."""

from collections.abc import Mapping

import pytest
from firmware_drivers.servo import Servos
from pan_tilt.rig import PanTiltRig

from firmware_runtime import SECOND, ConfigError, OpenBoard, RunState, Strike, open_board
from firmware_runtime.board import registry
from sim_doubles.faults import FaultScript, NackAddress

EYES = 0x48
STILL: Mapping[str, object] = {"world.swing_rad": 0.0}


def on_doubles(settings: Mapping[str, object] = STILL) -> OpenBoard:
    """The robot on doubles of its chips, with these settings."""
    return open_board("pan_tilt", doubles=True, clock="virtual", set=settings)


def rig_of(robot: OpenBoard) -> PanTiltRig:
    """The doubles, and the world behind them."""
    assert isinstance(robot.rig, PanTiltRig)
    return robot.rig


@pytest.mark.parametrize("azimuth_rad", [-1.2, -0.4, 0.0, 1.2])
@pytest.mark.parametrize("elevation_rad", [-0.3, 0.6])
def test_it_looks_at_a_light_wherever_it_is(azimuth_rad: float, elevation_rad: float) -> None:
    there = {"world.azimuth_rad": azimuth_rad, "world.elevation_rad": elevation_rad}
    with on_doubles({**STILL, **there}) as robot:
        robot.run(5.0)
        assert robot.result["on_target"] is True
        assert rig_of(robot).pwm.warnings == []
        assert rig_of(robot).adc.warnings == []


def test_it_sees_as_well_by_a_driver_that_was_written_for_circuitpython() -> None:
    pytest.importorskip("adafruit_ads1x15", reason="adafruit-circuitpython-ads1x15 is missing")
    eyes = {"eyes.driver": "adafruit"}
    with on_doubles({**STILL, **eyes}) as robot:
        robot.run(5.0)
        assert robot.result["on_target"] is True
        assert robot.statistics.bus["i2c1"].errors == 0


def test_a_light_that_swings_is_followed_on_a_bus_as_busy_as_its_board_file_says() -> None:
    with on_doubles({}) as robot:
        robot.run(8.0)
        assert robot.result["on_target"] is True
    with on_doubles({}) as robot:
        bus = rig_of(robot).buses["i2c1"]
        robot.run(1.0)
        before = bus.bits
        robot.run(5.0)
        load = registry.load("pan_tilt").loads["i2c1"]
        assert (bus.bits - before) / load.bus_hz / 5.0 == pytest.approx(load.utilisation, rel=0.02)


@pytest.mark.parametrize("output", [0.0, 1.0])
def test_a_servo_that_does_not_turn_is_reported_within_half_a_second(output: float) -> None:
    broken = Strike("full-on", "servos", at_s=3.0, amount=output)
    with open_board("pan_tilt", doubles=True, clock="virtual", faults=[broken]) as robot:
        robot.run(3.0)
        assert dict(robot.statistics.faults) == {}
        robot.run(0.5)
        assert set(robot.statistics.faults) & {"controller.pan_check", "controller.tilt_check"}


def test_an_axis_that_comes_no_nearer_for_2_s_ends_the_run() -> None:
    dead = Strike("dead", "servos", at_s=5.0, amount=0.0)
    with open_board("pan_tilt", doubles=True, clock="virtual", faults=[dead]) as robot:
        ended = robot.run(10.0)
        assert ended.state is RunState.FAILED
        assert "pan_check: difference to the light" in ended.reason
        assert 2 < ended.at / SECOND - 5.0 < 3


def test_in_the_dark_or_when_its_light_goes_out_it_searches_to_and_fro() -> None:
    dark = {"world.shines_from_s": 100.0}
    with on_doubles(dark) as robot:
        robot.run(5.0)
        assert robot.result["following"] is False
        assert abs(rig_of(robot).pan.angle_rad(robot.now)) > 0.5
    brief = {"world.shines_until_s": 3.0}
    with on_doubles(brief) as robot:
        robot.run(3.0)
        assert robot.result["following"] is True
        robot.run(3.0)
        assert robot.result["following"] is False


def test_eyes_that_fall_silent_leave_the_head_where_it_looks() -> None:
    with on_doubles() as robot:
        robot.run(3.0)
        before = rig_of(robot).pan.angle_rad(robot.now)
        silent = NackAddress(address=EYES, times=None, since=3 * SECOND)
        rig_of(robot).buses["i2c1"].faults = FaultScript([silent])
        robot.run(3.0)
        assert rig_of(robot).pan.angle_rad(robot.now) == pytest.approx(before, abs=0.05)


@pytest.mark.slow
def test_a_head_that_was_blind_for_a_while_turns_back_to_its_light_and_not_past_it() -> None:
    fast = {"world.swing_rad": 0.3, "world.swing_s": 4.0}
    with on_doubles(fast) as robot:
        rig = rig_of(robot)
        silent = NackAddress(address=EYES, times=None, since=10 * SECOND, until=11 * SECOND)
        rig.buses["i2c1"].faults = FaultScript([silent])
        robot.run(10.0)
        beside = []
        for _ in range(50):
            robot.run(0.05)
            beside.append(rig.light.direction(robot.now)[0] - rig.pan.angle_rad(robot.now))
        assert max(map(abs, beside)) == pytest.approx(0.43, abs=0.03)  # as it saw it again


def pans_after(disarmed_s: float, shines_from_s: float) -> list[float]:
    """Where a head that was kept from turning for so long looks from then on."""
    shines = {"world.shines_from_s": shines_from_s, "world.shines_until_s": 2e3}
    with on_doubles({**STILL, **shines}) as robot:
        servos = robot.model.components["servos"]
        assert isinstance(servos, Servos)
        servos.interlock = lambda: robot.now >= disarmed_s * SECOND
        robot.run(disarmed_s)
        seen = []
        for _ in range(50):
            robot.run(0.1)
            seen.append(rig_of(robot).pan.angle_rad(robot.now))
        return seen


@pytest.mark.slow
@pytest.mark.parametrize("shines_from_s", [0.0, 1e3], ids=["following", "searching"])
def test_time_spent_disarmed_changes_no_later_answer(shines_from_s: float) -> None:
    waited = pans_after(50.0, shines_from_s)
    assert max(waited) > 0.5
    assert waited == pytest.approx(pans_after(2.0, shines_from_s), abs=0.01)


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


def test_what_it_cannot_see_yet_it_does_not_turn() -> None:
    deaf = Strike("nack", "eyes", at_s=0.001, for_s=1.0)
    with open_board("pan_tilt", doubles=True, clock="virtual", faults=[deaf]) as robot:
        robot.run(1.0)
        assert not any(rig_of(robot).outputs.values())
        robot.run(2.0)
        assert robot.result["following"] is True
