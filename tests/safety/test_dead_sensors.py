"""No command is computed from what is dead: each chip's failures, and TachoBot with a dead gyro."""

import os
import struct
from collections.abc import Mapping

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.faults import FaultScript, ForcedRegister
from sim_doubles.inertial_truth import BodyMotion
from tests.support.dead_sensors import BEGIN, DOCUMENT, END, table
from tests.support.healthy_sensors import MOTIONS, chips, compare_headings, count_alarms
from tests.support.safety_table import written_between
from tests.support.virtual_tachobot import virtual_tachobot

IMU = 0x68
ACCELERATION, RATE, RATE_Z = 0x3B, 0x43, 0x47


def frozen(register: int, data: bytes) -> dict[int, int]:
    return {register + place: byte for place, byte in enumerate(data)}


DEAD = {
    "the whole burst frozen": frozen(
        ACCELERATION, struct.pack(">7h", 30, -20, 8192, 3000, 5, -3, 300)
    ),
    "the gyro frozen in motion": frozen(RATE, struct.pack(">3h", 5, -3, 300)),
    "the gyro zero": frozen(RATE, bytes(6)),
    "one axis of it frozen": frozen(RATE_Z, struct.pack(">h", 1500)),
}


@pytest.mark.slow
def test_the_table_of_the_page_is_what_the_drivers_find() -> None:
    found = table()
    if os.environ.get("FIRMWARE_RUNTIME_DEAD_SENSORS"):
        written_between(BEGIN, END, DOCUMENT, found)
    written = DOCUMENT.read_text().partition(BEGIN)[2].partition(END)[0]
    assert written.strip().splitlines() == found


@pytest.mark.slow
@pytest.mark.parametrize("motion", MOTIONS)
def test_healthy_noise_is_never_taken_for_a_dead_sensor(motion: str) -> None:
    """A quarter of an hour of each, or so many hours."""
    hours = float(os.environ.get("FIRMWARE_RUNTIME_HEALTHY_HOURS", "0.25"))
    found = [count_alarms(chip, motion, hours, 7) for chip in chips()]
    found.append(compare_headings(motion, hours, 7))
    assert [each for each in found if each.alarms] == []


@pytest.mark.slow
@pytest.mark.parametrize("registers", DEAD.values(), ids=DEAD)
def test_outputs_of_tachobot_go_off_and_on_again_when_the_gyro_lives(
    registers: Mapping[int, int],
) -> None:
    robot = virtual_tachobot()
    robot.run(1.5)
    bus = robot.rig.buses["i2c1"]
    bus.faults = FaultScript(
        [
            ForcedRegister(address=IMU, register=register, value=value, times=None)
            for register, value in registers.items()
        ]
    )
    robot.run(1.9)
    sent = len(robot.values("imu.sample"))
    assert robot.rig.thrust.all_off
    assert abs(robot.values("world.yaw_rate_rad_s")[-1]) < 1.5
    died = next(fault for fault in robot.faults() if fault.kind == "Stuck")
    assert "rate z" in died.axis
    assert 20 * MILLISECOND < died.duration < SECOND / 4
    robot.run(5)  # brought up again some times, which proves nothing
    assert len(robot.values("imu.sample")) == sent
    assert robot.rig.thrust.all_off
    bus.faults = None
    robot.run(5.5)
    assert not robot.rig.thrust.all_off


@pytest.mark.slow
def test_a_gyro_of_the_wrong_sign_is_contradicted_by_the_compass() -> None:
    robot = virtual_tachobot()
    felt = robot.rig.world.motion

    def mirrored(at: int) -> BodyMotion:
        motion = felt(at)
        x, y, z = motion.rate
        return BodyMotion(motion.acceleration, (x, y, -z), motion.temperature_c)

    robot.rig.imu._inertia = mirrored
    robot.run(6)
    contradictions = [each for each in robot.faults() if each.kind == "Implausible"]
    assert contradictions
    assert contradictions[0].axis.startswith("heading")
    assert robot.rig.thrust.all_off
