"""Settings of an MPU-9250, and the five registers 0x19 to 0x1D that hold them."""

import math
from typing import Final

from msgspec import Struct

from firmware_drivers.chips.ak8963 import MEASUREMENT_HZ
from firmware_drivers.chips.i2c_chip import choice_fault
from firmware_drivers.chips.liveness import fresh_noise
from firmware_drivers.chips.mounting import parse_mounting
from firmware_runtime.errors import SettingError

_SECOND_NS: Final = 1_000_000_000
INTERNAL_HZ: Final = 1000
GYRO_RANGES_DPS: Final = (250, 500, 1000, 2000)
ACCEL_RANGES_G: Final = (2, 4, 8, 16)
BANDWIDTHS_HZ: Final = (184, 92, 41, 20, 10, 5)
"""Gyroscope bandwidths of DLPF_CFG 1 to 6, the settings at which the chip samples at 1 kHz / n."""

COUNTS_FULL_SCALE: Final = 32768
ACCELERATION_NOISE_G: Final = 300e-6
RATE_NOISE_DPS: Final = 0.01
"""Typical noise densities per root of a hertz (PS-MPU-9250A-01 rev. 1.1, tables 1 and 2)."""


class Mpu9250Settings(Struct, frozen=True, kw_only=True):
    """Sample rate, filter, ranges and mounting; any may be wrong until `faults` was checked.

    The rate wants a margin over the reader's: the chip's clock and the PC's drift, and a reader as
    fast as the chip meets a moment without a new sample now and then. `bandwidth_hz` is the
    gyroscope's; the accelerometer gets the same filter setting, 44.8 Hz where the gyroscope has 41.
    """

    sample_hz: int = 200
    bandwidth_hz: int = 41
    accel_range_g: int = 4
    gyro_range_dps: int = 500
    mounting: str = "+x +y +z"
    """Sensor axes along body x, y and z: see `firmware_drivers.chips.mounting`."""
    also_accept: tuple[int, ...] = ()
    """WHO_AM_I values the user vouches for, beside the known ones."""
    mean_acceleration_g: tuple[float, float] = (0.6, 1.6)
    """Least and most specific force on average of some seconds; a racer in its curves feels more.
    """

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        faults = [
            *choice_fault("bandwidth_hz", self.bandwidth_hz, BANDWIDTHS_HZ),
            *choice_fault("accel_range_g", self.accel_range_g, ACCEL_RANGES_G),
            *choice_fault("gyro_range_dps", self.gyro_range_dps, GYRO_RANGES_DPS),
        ]
        if not 4 <= self.sample_hz <= INTERNAL_HZ or INTERNAL_HZ % self.sample_hz:
            faults.append(f"sample_hz: {self.sample_hz}, expected a divisor of 1000 from 4 to 1000")
        least, most = self.mean_acceleration_g
        if not 0.0 <= least < 1.0 < most < math.inf:
            faults.append(
                f"mean_acceleration_g: {least}, {most}, expected a number below 1 and one above"
            )
        try:
            parse_mounting(self.mounting)
        except SettingError as error:
            faults.append(str(error))
        return tuple(faults)

    def fresh_counts(self) -> tuple[float, ...]:
        """Deviation of the fresh noise of acceleration and rate, x y z of each, in counts."""
        acceleration, rate = (
            fresh_noise(density * math.sqrt(self.bandwidth_hz), self.bandwidth_hz, self.sample_hz)
            * COUNTS_FULL_SCALE
            / full_scale
            for density, full_scale in (
                (ACCELERATION_NOISE_G, self.accel_range_g),
                (RATE_NOISE_DPS, self.gyro_range_dps),
            )
        )
        return (acceleration,) * 3 + (rate,) * 3

    def registers(self) -> bytes:
        """Contents of SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG and ACCEL_CONFIG2."""
        dlpf = 1 + BANDWIDTHS_HZ.index(self.bandwidth_hz)
        return bytes(
            (
                INTERNAL_HZ // self.sample_hz - 1,
                dlpf,
                GYRO_RANGES_DPS.index(self.gyro_range_dps) << 3,
                ACCEL_RANGES_G.index(self.accel_range_g) << 3,
                dlpf,
            )
        )

    def samples_a_fetch(self) -> int:
        """Count the samples from one fetch of the magnetometer to the next; 32 at most.

        As few as keep fetches at or below its 100 measurements a second. A faster master would find
        DRDY cleared by its own fetch just before, and a new measurement would look old to a reader
        that comes after that.
        """
        return math.ceil(self.sample_hz / MEASUREMENT_HZ)

    def readings_a_fetch(self, period_ns: int | None = None) -> int:
        """Count the readings that one fetch may be in, at the most.

        `period_ns` is from one reading to the next; None: each sample is read.
        """
        samples = self.samples_a_fetch()
        if period_ns is None:
            return samples
        return min(samples, 1 + samples * _SECOND_NS // (self.sample_hz * period_ns))
