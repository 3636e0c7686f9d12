"""Hours of healthy readings through the checks for dead sensors, which must not raise an alarm.

Each chip's raw counts as its double gives them (its data sheet's noise, rounded), at rest and
moving, go through the very checks that its driver makes; the cross-check gets TachoBot's gyro and
compass.
"""

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from firmware_boards.tachobot.attitude import heading_check
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_boards.tachobot.wiring import chip_settings
from firmware_drivers.chips.cmps12 import FIELD_PERIOD_NS, FRESH_STEPS
from firmware_drivers.chips.hmc5883l import FRESH_GAUSS
from firmware_drivers.chips.liveness import Liveness
from firmware_drivers.chips.mpu9250_burst import FIELD_NOISE_COUNTS, InertialChecks
from numpy.typing import NDArray

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import DeadReading

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
        InertialChecks("MPU-9250", imu).check,
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
