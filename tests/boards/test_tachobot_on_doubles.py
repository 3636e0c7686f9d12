"""TachoBot, whole, on its doubles in virtual time."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest
from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.result import SETTLED_RAD, SETTLED_RAD_S, result_text

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import Message
from sim_doubles.faults import Fault, FaultScript, NackAddress, StuckSda
from tests.support.magnetometer import disable_magnetometer
from tests.support.virtual_tachobot import VirtualTachobot, virtual_tachobot

pytestmark = pytest.mark.slow

IMU, MAGNETOMETER, THRUST = 0x68, 0x0C, 0x40
MOUNTINGS = ("+y -x +z", "+x -y -z", "+z +x +y")


def flown(until_s: float, *assignments: str, checked: bool = False) -> VirtualTachobot:
    robot = virtual_tachobot(*assignments, checked=checked)
    robot.run(until_s)
    return robot


def strike(robot: VirtualTachobot, *faults: Fault) -> None:
    robot.rig.buses["i2c1"].faults = FaultScript(faults)


def yaw_rad(robot: VirtualTachobot) -> object:
    return robot.rig.result(robot.simulator.now, {})["yaw_rad"]


def test_since_when_it_is_settled_is_the_first_tick_of_those_it_has_been() -> None:
    robot = flown(10)
    own = robot.robot.own_result()
    pairs = [
        *zip(robot.received["world.yaw_rad"], robot.values("world.yaw_rate_rad_s"), strict=True)
    ]
    restless = [
        at for (at, yaw), rate in pairs if abs(1.0 - yaw) > SETTLED_RAD or abs(rate) > SETTLED_RAD_S
    ]
    first = min(at for (at, _), _ in pairs if at > max(restless))
    result: dict[str, Any] = robot.rig.result(10 * SECOND, own)
    after_s = result["settled_after_s"]
    assert first / SECOND <= after_s < first / SECOND + 0.001, "within that tick"
    assert result_text(result) == f"TachoBot turned to 1.01 rad and settled after {after_s:.1f} s"
    elsewhere = robot.rig.result(10 * SECOND, {})
    assert elsewhere == {**result, "settled_after_s": None}, "the reference is the controller's"


def test_it_turns_to_one_radian_and_rests_there() -> None:
    robot = flown(0.5, checked=True)
    thrust, bus = robot.rig.thrust, robot.rig.buses["i2c1"]
    assert thrust.all_off, "while it is calibrated"
    assert robot.values("imu.sample") == []
    robot.run(1.5)
    assert robot.values("thrust_pairs.duties")[-1] == thrust.duties[:8]
    robot.run(2)
    before = bus.transactions, bus.bytes
    robot.run(3)
    # of a tick two transactions and sixty bytes; a poll a second of nine
    assert (bus.transactions - before[0], bus.bytes - before[1]) == (2 * 100 + 2, 60 * 100 + 9)
    robot.run(10)
    assert robot.rig.result(10 * SECOND, {})["settled"] is True
    assert yaw_rad(robot) == pytest.approx(1.0, abs=0.02)
    assert max(robot.values("world.yaw_rad")) < 1.15
    assert robot.faults() == []
    # every tick carries what an outside simulator needs
    ticks = [at for at, _ in robot.received["imu.sample"]]
    assert all(b - a == 10 * MILLISECOND for a, b in pairwise(ticks))
    for port in ("world.yaw_rad", "world.yaw_rate_rad_s", "controller.yaw.command_n"):
        assert [at for at, _ in robot.received[port]] == ticks
    assert [at for at, _ in robot.received["thrust_pairs.duties"]] == ticks
    assert all(len(duties) == 8 for duties in robot.values("thrust_pairs.duties"))


def test_equation_one_holds_between_two_ticks() -> None:
    """The yaw acceleration is 2 R / Iz times the third command, once the motors have followed."""
    robot = flown(2, "world.motor_lag_s=0")
    rates, commands = robot.values("world.yaw_rate_rad_s"), robot.values("controller.yaw.command_n")
    for n in range(1, 50):
        acceleration = (rates[n + 1] - rates[n]) / 0.01
        assert acceleration == pytest.approx(2 * 0.2 / 0.075 * commands[n], abs=0.01)


def test_the_same_seed_gives_the_same_values_and_another_seed_does_not() -> None:
    first, again, other = (flown(2, f"world.seed={seed}").received for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_the_gyros_bias_is_measured_and_taken_off_unless_it_turns_at_the_start() -> None:
    assert flown(1, "world.gyro_bias_rad_s=0.08").model.imu.bias[2] == pytest.approx(0.08, abs=1e-3)
    robot = flown(2, "world.gyro_bias_rad_s=0.5", checked=True)
    assert robot.values("imu.sample") == []
    assert robot.rig.thrust.all_off
    assert {fault.kind for fault in robot.faults()} == {"NotReady"}
    assert "the robot turns" in robot.faults()[0].reason
    why = robot.model.imu.unready() or ""
    assert why.startswith("is not calibrated yet (gyro bias: mean rate about z is ")


# Faults -------------------------------------------------------------------------------------------


def test_a_silent_imu_switches_the_propellers_off_in_time() -> None:
    robot = flown(2, checked=True)
    strike(robot, NackAddress(address=IMU, times=None))
    robot.run(2.045)
    assert not robot.rig.thrust.all_off
    robot.run(2.06)
    assert robot.rig.thrust.all_off
    assert {fault.kind for fault in robot.values("imu.fault")} == {"NoAcknowledge"}
    assert "no forces for" in robot.values("thrust_pairs.fault")[-1].reason


def test_it_recovers_from_a_brown_out_of_the_imu_and_of_the_propellers_chip() -> None:
    robot, other = flown(4), flown(4, checked=True)
    robot.rig.imu.power_cycle()
    robot.rig.magnetometer.power_cycle()
    other.rig.thrust.power_cycle()
    robot.run(8)
    other.run(8)
    assert robot.values("imu.fault") != []
    assert robot.received["imu.sample"][-1][0] == 8 * SECOND
    assert yaw_rad(robot) == pytest.approx(1.0, abs=0.1)
    (fault,) = other.faults()
    found = "MODE1, MODE2, PRE_SCALE read 11 11 1e, expected 20 04 05"
    assert f"PCA9685 at 0x40 on i2c1: {found}" in fault.reason
    assert other.values("thrust_pairs.duties")[-1] == other.rig.thrust.duties[:8]
    assert yaw_rad(other) == pytest.approx(1.0, abs=0.05)


def test_a_stuck_bus_is_a_fault_and_stopping_goes_on_until_acknowledged() -> None:
    robot = flown(2, checked=True)
    strike(robot, StuckSda(address=THRUST))
    robot.run(2.3)
    assert {fault.kind for fault in robot.faults()} == {"BusTimeout"}
    assert not robot.rig.thrust.all_off
    robot.rig.buses["i2c1"].recover()
    robot.run(2.4)
    assert robot.rig.thrust.all_off


@pytest.mark.parametrize("dies_at_s", [0, 3], ids=["absent", "dies in flight"])
def test_without_magnetometer_it_says_so_and_flies_on_six_axes(dies_at_s: int) -> None:
    robot = flown(dies_at_s) if dies_at_s else virtual_tachobot()
    if dies_at_s:
        disable_magnetometer(robot.rig.buses["i2c1"])
    else:
        strike(robot, NackAddress(address=MAGNETOMETER, times=None))
    robot.run(6)
    (warning,) = robot.values("imu.fault")
    assert "six axes only" in warning.reason
    fields = [sample.field for sample in robot.values("imu.sample")]
    assert {*(fields[-1:] if dies_at_s else fields)} == {None}
    assert yaw_rad(robot) == pytest.approx(1.0, abs=0.03)


def test_forces_that_are_not_numbers_switch_off() -> None:
    robot = flown(2, checked=True)
    allocation = robot.model.controller.components["allocation"]
    assert isinstance(allocation, Allocation)
    allocation.pair_thrust_n = math.nan
    robot.run(2.02)
    assert robot.rig.thrust.all_off
    assert "expected finite numbers" in robot.values("thrust_pairs.fault")[-1].reason


# Settings -----------------------------------------------------------------------------------------


def test_a_delay_in_the_yaw_loop_postpones_every_force() -> None:
    robot = flown(2, "controller.yaw.delay_s=0.08", checked=True)
    commanded = [at for at, _ in robot.received["controller.yaw.command_n"]]
    written = [at for at, _ in robot.received["thrust_pairs.duties"]]
    assert written[0] - commanded[0] == 80 * MILLISECOND


def test_a_smith_predictor_gives_back_the_step_that_a_delay_spoils() -> None:
    fast = ("controller.yaw.kp=6.0", "controller.yaw.kd=1.6", "controller.yaw.delay_s=0.08")
    assert max(flown(6, *fast).values("world.yaw_rad")) > 1.4
    predicted = flown(6, *fast, "controller.yaw.smith.delay_s=0.08").values("world.yaw_rad")
    assert max(predicted) < 1.2
    assert predicted[-1] == pytest.approx(1.0, abs=0.01)


def test_a_smith_predictor_of_no_delay_changes_not_a_bit() -> None:
    plain, predicted = flown(3), flown(3, "controller.yaw.smith.delay_s=0")
    assert predicted.received["thrust_pairs.duties"] == plain.received["thrust_pairs.duties"]


def test_friction_holds_it_short_of_the_reference() -> None:
    robot = flown(6, "world.static_friction_nm=0.05", "world.coulomb_friction_nm=0.03")
    assert robot.values("world.yaw_rate_rad_s")[-1] == 0.0
    assert 0.5 < robot.values("world.yaw_rad")[-1] < 0.999


@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_a_turned_imu_gives_the_same_flight(mounting: str) -> None:
    assert yaw_rad(flown(5, f"imu.mounting={mounting}")) == pytest.approx(1.0, abs=0.03)


def test_free_mode_lifts_first_then_holds_x_y_and_yaw_and_both_chips_are_made_safe() -> None:
    robot = flown(2.9, "controller.mode=free", "controller.x.reference_m=0.5")
    esc = robot.rig.esc
    assert esc is not None
    assert esc.duty(0) == pytest.approx(1000e-6 * 50, abs=1 / 4096)
    assert robot.rig.thrust.all_off
    robot.run(16)
    assert esc.duty(0) == pytest.approx(1600e-6 * 50, abs=1 / 4096)
    state = robot.rig.world.state(16 * SECOND + MILLISECOND)  # a sample's time on the wire later
    assert (state.x_m, state.y_m, state.yaw_rad) == pytest.approx((0.5, 0.0, 1.0), abs=0.05)
    assert robot.rig.outputs == {"thrust_pairs": 8, "esc": 1}
    assert robot.robot.make_safe() == []
    assert robot.rig.outputs == {"thrust_pairs": 0, "esc": 0}
    assert robot.rig.thrust.all_off


def test_a_lift_whose_chip_failed_is_armed_again_and_nothing_turns_meanwhile() -> None:
    robot = flown(4.0, "controller.mode=free")
    esc = robot.rig.esc
    assert esc is not None
    esc.power_cycle()
    robot.run(5.5)
    assert esc.duty(0) == pytest.approx(1000e-6 * 50, abs=1 / 4096)
    assert robot.rig.thrust.all_off
    robot.run(14)
    assert esc.duty(0) == pytest.approx(1600e-6 * 50, abs=1 / 4096)
    assert yaw_rad(robot) == pytest.approx(1.0, abs=0.05)


def test_it_comes_down_where_nothing_reaches_its_pairs_for_two_seconds() -> None:
    robot = flown(4.5, "controller.mode=free")
    strike(robot, NackAddress(address=THRUST, times=None))
    robot.run(6.4)
    assert robot.received["controller.attitude.ended"] == []
    robot.run(6.6)
    ((_, ending),) = robot.received["controller.attitude.ended"]
    assert ending.failed
    assert ending.reason.startswith("the thrust pairs have been out of reach for 2 s: i2c1 0x40")


def test_pairs_that_were_out_of_reach_for_less_are_driven_again() -> None:
    robot = flown(4.5, "controller.mode=free")
    for until_s in (6.0, 8.0):
        strike(robot, NackAddress(address=THRUST, times=None))
        robot.run(until_s)
        strike(robot)
        robot.run(until_s + 0.5)
        assert all(robot.rig.outputs.values())
    assert robot.received["controller.attitude.ended"] == []


def test_turns_while_it_hovers_on_a_failed_bus_are_not_unwound() -> None:
    """It turns on at 4 rad/s and is off until its speed controller is armed again."""
    robot = flown(3.3, "controller.mode=free")
    strike(robot, NackAddress(times=None))
    robot.run(4.8)
    strike(robot)
    robot.run(16)
    result = robot.rig.result(16 * SECOND, robot.robot.own_result())
    assert result["yaw_rad"] == pytest.approx(1.0 + 2 * math.tau, abs=0.05)
    assert result["yaw_error_rad"] == pytest.approx(0.0, abs=0.05)
    assert result["settled"]
    assert max(map(abs, robot.values("world.yaw_rate_rad_s"))) < 5.0


def test_on_the_platform_one_pca9685_and_one_mpu9250_are_all_it_takes() -> None:
    robot = virtual_tachobot()
    spoken_to: set[int] = set()
    bus = robot.rig.buses["i2c1"]
    transfer = bus.transfer

    def noted(address: int, messages: Sequence[Message]) -> bytes:
        spoken_to.add(address)
        return transfer(address, messages)

    bus.transfer = noted  # type: ignore[method-assign]
    robot.robot.find_chips()
    robot.run(5)
    assert robot.robot.make_safe() == []
    assert spoken_to == {THRUST, IMU, MAGNETOMETER}
    assert "esc" not in robot.model.components
    strike(robot, NackAddress(address=THRUST, times=None))
    (failure,) = robot.robot.make_safe()
    assert "0x40" in failure
