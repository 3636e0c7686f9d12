"""TachoBot, whole, on its doubles in virtual time."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest
from firmware_boards.tachobot.allocation import Allocation

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import Message
from sim_doubles.faults import FaultScript, NackAddress, StuckSda
from tests.support.magnetometer import disable_magnetometer
from tests.support.virtual_tachobot import virtual_tachobot

pytestmark = pytest.mark.slow

IMU, MAGNETOMETER, THRUST = 0x68, 0x0C, 0x40


def test_it_turns_to_one_radian_and_rests_there() -> None:
    robot = virtual_tachobot(checked=True)
    robot.run(10)
    result = robot.rig.result(10 * SECOND, {})
    assert result["settled"] is True
    assert result["yaw_rad"] == pytest.approx(1.0, abs=0.02)
    assert max(robot.values("world.yaw_rad")) < 1.15
    assert robot.faults() == []


def test_a_tick_costs_two_transactions_and_sixty_bytes_a_second_one_poll_of_nine() -> None:
    robot = virtual_tachobot()
    robot.run(2)
    bus = robot.rig.buses["i2c1"]
    before = bus.transactions, bus.bytes
    robot.run(3)
    ticks = 100
    assert (bus.transactions - before[0], bus.bytes - before[1]) == (2 * ticks + 2, 60 * ticks + 9)


def test_every_tick_carries_what_an_outside_simulator_needs() -> None:
    robot = virtual_tachobot()
    robot.run(2)
    ticks = [at for at, _ in robot.received["imu.sample"]]
    assert all(b - a == 10 * MILLISECOND for a, b in pairwise(ticks))
    for port in ("world.yaw_rad", "world.yaw_rate_rad_s", "controller.yaw.command_n"):
        assert [at for at, _ in robot.received[port]] == ticks
    assert [at for at, _ in robot.received["thrust_pairs.duties"]] == ticks
    assert all(len(duties) == 8 for duties in robot.values("thrust_pairs.duties"))


def test_the_reported_duties_are_the_chips() -> None:
    robot = virtual_tachobot()
    robot.run(1.5)
    assert robot.values("thrust_pairs.duties")[-1] == robot.rig.thrust.duties[:8]


def test_equation_one_holds_between_two_ticks() -> None:
    """The yaw acceleration is 2 R / Iz times the third command, once the motors have followed."""
    robot = virtual_tachobot("world.motor_lag_s=0")
    robot.run(2)
    rates, commands = robot.values("world.yaw_rate_rad_s"), robot.values("controller.yaw.command_n")
    for n in range(1, 50):
        acceleration = (rates[n + 1] - rates[n]) / 0.01
        assert acceleration == pytest.approx(2 * 0.2 / 0.075 * commands[n], abs=0.01)


def test_the_same_seed_gives_the_same_values_and_another_seed_does_not() -> None:
    runs = []
    for seed in (1, 1, 2):
        robot = virtual_tachobot(f"world.seed={seed}")
        robot.run(2)
        runs.append(robot.received)
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_it_starts_off_and_stays_off_while_it_is_calibrated() -> None:
    robot = virtual_tachobot()
    robot.run(0.5)
    assert robot.rig.thrust.all_off
    assert robot.values("imu.sample") == []


def test_the_gyros_bias_is_measured_and_taken_off() -> None:
    robot = virtual_tachobot("world.gyro_bias_rad_s=0.08")
    robot.run(1)
    assert robot.model.imu.bias[2] == pytest.approx(0.08, abs=1e-3)


def test_a_gyro_that_turns_at_the_start_is_not_calibrated() -> None:
    robot = virtual_tachobot("world.gyro_bias_rad_s=0.5", checked=True)
    robot.run(2)
    assert robot.values("imu.sample") == []
    assert robot.rig.thrust.all_off
    assert {fault.kind for fault in robot.faults()} == {"NotReady"}
    assert "the robot turns" in robot.faults()[0].reason
    why = robot.model.imu.unready()
    assert why is not None
    assert why.startswith("is not calibrated yet (gyro bias: mean rate about z is ")


def test_a_silent_imu_switches_the_propellers_off_in_time() -> None:
    robot = virtual_tachobot(checked=True)
    robot.run(2)
    assert not robot.rig.thrust.all_off
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=IMU, times=None)])
    robot.run(2.045)
    assert not robot.rig.thrust.all_off
    robot.run(2.06)
    assert robot.rig.thrust.all_off
    kinds = [fault.kind for fault in robot.values("imu.fault")]
    assert set(kinds) == {"NoAcknowledge"}
    assert "no forces for" in robot.values("thrust_pairs.fault")[-1].reason


def test_it_recovers_from_a_brown_out_of_the_imu() -> None:
    robot = virtual_tachobot()
    robot.run(4)
    robot.rig.imu.power_cycle()
    robot.rig.magnetometer.power_cycle()
    robot.run(8)
    assert robot.values("imu.fault") != []
    assert robot.received["imu.sample"][-1][0] == 8 * SECOND
    assert robot.rig.result(8 * SECOND, {})["yaw_rad"] == pytest.approx(1.0, abs=0.1)


def test_it_recovers_from_a_brown_out_of_the_propellers_chip_and_says_so() -> None:
    robot = virtual_tachobot(checked=True)
    robot.run(4)
    robot.rig.thrust.power_cycle()
    robot.run(8)
    (fault,) = robot.faults()
    assert (
        "PCA9685 at 0x40 on i2c1: MODE1, MODE2, PRE_SCALE read 11 11 1e, expected 20 04 05"
        in fault.reason
    )
    assert robot.values("thrust_pairs.duties")[-1] == robot.rig.thrust.duties[:8]
    assert robot.rig.result(8 * SECOND, {})["yaw_rad"] == pytest.approx(1.0, abs=0.05)


def test_a_stuck_bus_is_a_fault_and_stopping_goes_on_until_acknowledged() -> None:
    robot = virtual_tachobot(checked=True)
    robot.run(2)
    robot.rig.buses["i2c1"].faults = FaultScript([StuckSda(address=THRUST)])
    robot.run(2.3)
    assert {fault.kind for fault in robot.faults()} == {"BusTimeout"}
    assert not robot.rig.thrust.all_off
    robot.rig.buses["i2c1"].recover()
    robot.run(2.4)
    assert robot.rig.thrust.all_off


def test_a_robot_without_magnetometer_says_so_and_flies_on_six_axes() -> None:
    robot = virtual_tachobot()
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=0x0C, times=None)])
    robot.run(6)
    (warning,) = robot.values("imu.fault")
    assert "six axes only" in warning.reason
    assert all(sample.field is None for sample in robot.values("imu.sample"))
    assert robot.rig.result(6 * SECOND, {})["yaw_rad"] == pytest.approx(1.0, abs=0.03)


def test_a_magnetometer_that_dies_in_flight_is_found_out_and_flown_without() -> None:
    robot = virtual_tachobot()
    robot.run(3)
    disable_magnetometer(robot.rig.buses["i2c1"])
    robot.run(6)
    (warning,) = robot.values("imu.fault")
    assert "six axes only" in warning.reason
    assert robot.values("imu.sample")[-1].field is None
    assert robot.rig.result(6 * SECOND, {})["yaw_rad"] == pytest.approx(1.0, abs=0.03)


def test_a_delay_in_the_yaw_loop_postpones_every_force() -> None:
    robot = virtual_tachobot("controller.yaw.delay_s=0.08", checked=True)
    robot.run(2)
    commanded = [at for at, _ in robot.received["controller.yaw.command_n"]]
    written = [at for at, _ in robot.received["thrust_pairs.duties"]]
    assert written[0] - commanded[0] == 80 * MILLISECOND


def test_a_smith_predictor_gives_back_the_step_that_a_delay_spoils() -> None:
    fast = ("controller.yaw.kp=6.0", "controller.yaw.kd=1.6", "controller.yaw.delay_s=0.08")
    robot = virtual_tachobot(*fast)
    robot.run(6)
    assert max(robot.values("world.yaw_rad")) > 1.4
    robot = virtual_tachobot(*fast, "controller.yaw.smith.delay_s=0.08")
    robot.run(6)
    assert max(robot.values("world.yaw_rad")) < 1.2
    assert robot.values("world.yaw_rad")[-1] == pytest.approx(1.0, abs=0.01)


def test_a_smith_predictor_of_no_delay_changes_not_a_bit() -> None:
    plain, predicted = virtual_tachobot(), virtual_tachobot("controller.yaw.smith.delay_s=0")
    plain.run(3)
    predicted.run(3)
    assert predicted.received["thrust_pairs.duties"] == plain.received["thrust_pairs.duties"]


def test_friction_holds_it_short_of_the_reference() -> None:
    robot = virtual_tachobot("world.static_friction_nm=0.05", "world.coulomb_friction_nm=0.03")
    robot.run(6)
    yaw, rate = robot.values("world.yaw_rad")[-1], robot.values("world.yaw_rate_rad_s")[-1]
    assert rate == 0.0
    assert 0.5 < yaw < 0.999


@pytest.mark.parametrize("mounting", ["+y -x +z", "+x -y -z", "+z +x +y"])
def test_a_turned_imu_gives_the_same_flight(mounting: str) -> None:
    robot = virtual_tachobot(f"imu.mounting={mounting}")
    robot.run(5)
    assert robot.rig.result(5 * SECOND, {})["yaw_rad"] == pytest.approx(1.0, abs=0.03)


def test_free_mode_lifts_first_and_then_holds_x_y_and_yaw() -> None:
    robot = virtual_tachobot("controller.mode=free", "controller.x.reference_m=0.5")
    esc = robot.rig.esc
    assert esc is not None
    robot.run(2.9)
    assert esc.duty(0) == pytest.approx(1000e-6 * 50, abs=1 / 4096)
    assert robot.rig.thrust.all_off
    robot.run(16)
    assert esc.duty(0) == pytest.approx(1600e-6 * 50, abs=1 / 4096)
    state = robot.rig.world.state(16 * SECOND + MILLISECOND)  # a sample's time on the wire later
    assert state.x_m == pytest.approx(0.5, abs=0.05)
    assert state.y_m == pytest.approx(0.0, abs=0.05)
    assert state.yaw_rad == pytest.approx(1.0, abs=0.05)


def test_forces_that_are_not_numbers_switch_off() -> None:
    robot = virtual_tachobot(checked=True)
    robot.run(2)
    allocation = robot.model.controller.components["allocation"]
    assert isinstance(allocation, Allocation)
    allocation.pair_thrust_n = math.nan
    robot.run(2.02)
    assert robot.rig.thrust.all_off
    assert "expected finite numbers" in robot.values("thrust_pairs.fault")[-1].reason


def test_make_safe_leaves_all_sixteen_channels_of_both_chips_off() -> None:
    robot = virtual_tachobot("controller.mode=free", checked=True)
    robot.run(4)
    assert robot.rig.outputs == {"thrust_pairs": 8, "esc": 1}
    assert robot.robot.make_safe() == []
    assert robot.rig.outputs == {"thrust_pairs": 0, "esc": 0}
    assert robot.rig.thrust.all_off


def test_what_cannot_be_made_safe_is_reported() -> None:
    robot = virtual_tachobot()
    robot.run(2)
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=THRUST, times=None)])
    (failure,) = robot.robot.make_safe()
    assert "0x40" in failure


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
