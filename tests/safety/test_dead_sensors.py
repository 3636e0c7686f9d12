"""No command is computed from what is dead: each chip's failures, and TachoBot with a dead gyro."""

import math
import os
import struct
from collections.abc import Callable, Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import pytest
from firmware_boards.tachobot.attitude import heading_check
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_boards.tachobot.wiring import chip_settings
from firmware_drivers.chips.cmps12 import FIELD_PERIOD_NS, FRESH_STEPS
from firmware_drivers.chips.hmc5883l import FRESH_GAUSS
from firmware_drivers.chips.liveness import Liveness
from firmware_drivers.chips.mpu9250_burst import FIELD_NOISE_COUNTS, InertialChecks
from numpy.typing import NDArray

from firmware_runtime import open_board
from firmware_runtime.board import registry
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import DeadReading
from firmware_runtime.models.cross_check import CrossCheck
from sim_doubles.faults import FaultScript, ForcedRegister
from sim_doubles.inertial_truth import BodyMotion
from tests.support.dead_sensors import BEGIN, DOCUMENT, END, table
from tests.support.magnetometer import disable_magnetometer
from tests.support.safety_table import written_between
from tests.support.virtual_tachobot import virtual_tachobot

Numbers: TypeAlias = NDArray[np.float64]
Check: TypeAlias = Callable[[tuple[int, ...]], None]
BLOCK: Final = 100_000
TICK: Final = 10 * MILLISECOND
MOTIONS: Final = ("at rest", "moving")


class Healthy(NamedTuple):
    """A chip that lives: its counts at rest, how far they move, its noise, and its check."""

    name: str
    rate_hz: float
    rest: tuple[float, ...]
    swing: tuple[float, ...]
    """Amplitude of what moves it, 0.3 Hz, in counts."""
    noise: tuple[float, ...]
    repeats: int
    """Readings of one and the same measurement."""
    check: Check


class Found(NamedTuple):
    """What came of one chip in one kind of motion."""

    chip: str
    motion: str
    readings: int
    alarms: int


def _inertial(checks: InertialChecks) -> Check:
    """Check acceleration and rate as a burst's decoder does."""

    def check(counts: tuple[int, ...]) -> None:
        checks.inertial.check(counts)
        x, y, z, *_ = counts
        checks.gravity.check(x, y, z)

    return check


def chips() -> Iterator[Healthy]:
    """Every chip with a check of its noise, as the boards set it."""
    imu = chip_settings(_tachobot())
    g, dps = 32768 / imu.accel_range_g, 32768 / imu.gyro_range_dps
    bandwidth = math.sqrt(1 / (4 * 3.9e-3))  # of the double's lag at 92 Hz
    yield Healthy(
        "MPU-9250, acceleration and rate",
        100,
        (0.0, 0.0, g, 0.0, 0.0, 0.6 * dps),
        (0.3 * g, 0.3 * g, 0.2 * g, 60 * dps, 60 * dps, 120 * dps),
        (300e-6 * g * bandwidth,) * 3 + (0.01 * dps * bandwidth,) * 3,
        1,
        _inertial(InertialChecks("MPU-9250", imu)),
    )
    earth = (20 / 0.15, 0.0, -40 / 0.15)
    yield Healthy(
        "AK8963",
        100,
        earth,
        (20 / 0.15, 20 / 0.15, 5.0),
        (2.0,) * 3,
        1,
        Liveness("AK8963", "xyz", (FIELD_NOISE_COUNTS,) * 3, repeats=imu.samples_a_fetch()).check,
    )
    yield Healthy(
        "CMPS12",
        50,
        (320.0, 0.0, -640.0),
        (320.0, 320.0, 80.0),
        (0.6 * 16,) * 3,
        3,
        Liveness(
            "CMPS12", "xyz", (FRESH_STEPS,) * 3, repeats=-(-FIELD_PERIOD_NS // 20_000_000)
        ).check,
    )
    yield Healthy(
        "HMC5883L",
        10,
        (218.0, 0.0, -436.0),
        (218.0, 218.0, 50.0),
        (2e-3 * 1090,) * 3,
        1,
        Liveness("HMC5883L", "xyz", (FRESH_GAUSS * 1090,) * 3).check,
    )


def _tachobot() -> TachobotSettings:
    settings: TachobotSettings = registry.load("tachobot", []).settings
    return settings


def count_alarms(chip: Healthy, motion: str, hours: float, seed: int) -> Found:
    """Run one chip's check over so many hours of its readings."""
    random = np.random.default_rng([seed, *chip.name.encode(), *motion.encode()])
    left = readings = round(hours * 3600 * chip.rate_hz)
    alarms = 0
    while left:
        block = min(left, BLOCK)
        counts = _counts(chip, random, readings - left, block, moves=motion == "moving")
        left -= block
        for each in counts:
            try:
                chip.check(each)
            except DeadReading:
                alarms += 1
    return Found(chip.name, motion, readings, alarms)


def _counts(
    chip: Healthy, random: np.random.Generator, begin: int, block: int, *, moves: bool
) -> list[tuple[int, ...]]:
    at = (begin + np.arange(block) // chip.repeats * chip.repeats) / chip.rate_hz
    measured = -(-block // chip.repeats)
    axes: list[list[int]] = []
    for axis, noise in enumerate(chip.noise):
        values = np.full(block, chip.rest[axis])
        if moves:
            values += chip.swing[axis] * np.sin(math.tau * 0.3 * at + axis)
        fresh = np.repeat(random.normal(0.0, noise, measured), chip.repeats)[:block]
        axes.append(np.rint(values + fresh).astype(int).tolist())
    return list(zip(*axes, strict=True))


def compare_headings(motion: str, hours: float, seed: int) -> Found:
    """Run TachoBot's gyro and compass through its check: noise, bias, scale of the data sheet."""
    comparison = heading_check(_tachobot().controller).comparison
    random = np.random.default_rng([seed, *motion.encode()])
    left = readings = round(hours * 3600 * 100)
    alarms = 0
    swing = 3.0 if motion == "moving" else 0.0
    while left:
        block = min(left, BLOCK)
        at = (readings - left + np.arange(block)) / 100
        left -= block
        rate = swing * np.cos(math.tau * 0.3 * at)
        heading = swing / (math.tau * 0.3) * np.sin(math.tau * 0.3 * at)
        said = 1.03 * rate + 0.0873 + random.normal(0.0, 0.002, block)
        field = heading + random.normal(0.0, 0.015, block)
        for one, other in zip(said.tolist(), field.tolist(), strict=True):
            comparison.take_rate(one, TICK)
            comparison.take_value(other, TICK)
            alarms += not comparison.agrees
    return Found("gyro against compass (TachoBot)", motion, readings, alarms)


IMU = 0x68
GYRO_Z, FIELD_Y = 5.0, 7.0
"""Numbers of their words, after those of the acceleration."""
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
@pytest.mark.parametrize("mode", ["platform", "free", "track"])
def test_gyro_and_compass_agree_by_half_of_what_is_believed_also_under_a_push(mode: str) -> None:
    settings = {"controller.mode": mode, "world.gyro_bias_rad_s": 0.05, "world.seed": 7}
    pushes = [Strike("push", at_s=at, amount=by) for at, by in ((4.0, 1.0), (5.5, -4.0))]
    excess: list[float] = []
    with open_board(
        "tachobot", doubles=True, clock="virtual", set=settings, faults=pushes
    ) as robot:
        controller = robot.model.components["controller"]
        assert isinstance(controller, Coupled)
        check = controller.components["heading_check"]
        assert isinstance(check, CrossCheck)
        comparison = check.comparison
        for _ in range(700):
            robot.run(0.01)
            assert comparison.agrees
            excess += [change.excess for change in comparison.changes]
    assert max(excess) < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["offset", "negate", "swap"])
def test_a_gyro_that_lies_for_a_second_is_contradicted_and_the_yaw_found_again(kind: str) -> None:
    lie = Strike(kind, "imu", at_s=2.5, for_s=1.0, amount=GYRO_Z)
    push = Strike("push", at_s=2.6, amount=2.0)  # a sign shows in a turn only
    with open_board("tachobot", doubles=True, clock="virtual", faults=[lie, push]) as robot:
        robot.run(3.3)
        assert robot.outputs == {"thrust_pairs": 0}
        robot.run(40.0)  # the one field that is believed after a gap is noisy
        assert robot.result["settled"] is True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "at_s"), [("platform", 0.27), ("platform", 0.72), ("track", 0.72)]
)
def test_a_compass_that_lied_about_where_it_was_at_first_ends_the_run(
    mode: str, at_s: float
) -> None:
    lie = Strike("negate", "imu", at_s=at_s, for_s=1.0, amount=FIELD_Y)
    chosen = {"controller.mode": mode}
    with open_board("tachobot", doubles=True, clock="virtual", set=chosen, faults=[lie]) as robot:
        ended = robot.run(10.0)
        assert "before it is certain where the robot was at first" in ended.reason
        assert set((robot.outputs or {}).values()) == {0}


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["platform", "track"])
def test_a_gyro_of_the_wrong_sign_without_a_compass_is_contradicted_by_thrust(mode: str) -> None:
    lie = Strike("negate", "imu", at_s=4.9, amount=GYRO_Z)
    push = Strike("push", at_s=5.0, amount=0.5)  # in "track" it is at rest by then
    chosen = {"controller.mode": mode}
    faults = [lie, push]
    with open_board("tachobot", doubles=True, clock="virtual", set=chosen, faults=faults) as robot:
        robot.run(4.0)
        assert robot.rig is not None
        disable_magnetometer(robot.rig.buses["i2c1"])
        ended = robot.run(6.0)
        assert "expected slowing down while it is driven by" in ended.reason
        assert set((robot.outputs or {}).values()) == {0}
        assert abs(robot.world.motion(robot.now).rate[2]) < 5.0


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
