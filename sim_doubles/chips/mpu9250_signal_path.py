"""The MPU-9250's three sensors, set up from its registers; the truth in SI goes in, bytes come out.

All three follow one sample clock. Acceleration and rate have the data sheet's noise, 300 ug and
0.01 degrees/s in a root hertz, in the bandwidth that the filter leaves; it belongs to a sample's
instant. An axis that is switched off reads 0, and so does a thermometer that is (PD_PTAT).

Source: InvenSense RM-MPU-9250A rev. 1.6 (its accelerometer filters differ from rev. 1.4), product
specification rev. 1.1 for noise and start-up, AN-MPU-9250A-03 for self-test.
"""

import math
from struct import Struct

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.mpu9250_registers import (
    ACCEL_CONFIG,
    ACCEL_CONFIG2,
    ACCEL_SELF_TEST_CODES,
    ACCEL_TRIM,
    CONFIG,
    GYRO_CONFIG,
    GYRO_SELF_TEST_CODES,
    GYRO_STANDBY,
    PD_PTAT,
    PWR_MGMT_1,
    PWR_MGMT_2,
    XA_OFFSET_H,
    XG_OFFSET_H,
    signed_word,
)
from sim_doubles.chips.mpu9250_sensor import Sensor, TriaxialSensor
from sim_doubles.inertial_truth import Inertia
from sim_doubles.worlds.noise import part_noise

ACCEL_START_UP = 20 * MILLISECOND
GYRO_START_UP = 35 * MILLISECOND

FULL_SCALE_COUNTS = 32768
G_M_S2 = 9.80665
ACCEL_NOISE_M_S2 = 300e-6 * G_M_S2  # in a root hertz, as the next
GYRO_NOISE_RAD_S = math.radians(0.01)
TEMPERATURE_LSB, TEMPERATURE_ZERO_C = 333.87, 21.0
SELF_TEST_LSB, SELF_TEST_STEP = 2620, 1.01
ACCEL_OFFSET_LSB = 16  # counts at +-2 g of one offset step, 1/1024 g, printed as 0.98 mg

GYRO_DELAY_MS = (0.97, 2.9, 3.9, 5.9, 9.9, 17.85, 33.48, 0.17)  # by DLPF_CFG
TEMPERATURE_DELAY_MS = (0.04, 1.9, 2.8, 4.8, 8.3, 13.4, 18.6, 0.04)
GYRO_BYPASS_DELAY_MS = (0.0, 0.064, 0.11, 0.064)  # by FCHOICE_B, which then also holds for 0.04
ACCEL_DELAY_MS = (1.88, 1.88, 2.88, 4.88, 8.87, 16.83, 32.48, 1.38)  # by A_DLPF_CFG
ACCEL_BYPASS_DELAY_MS = 0.503

SAMPLE = Struct(">7h")


class SignalPath:
    """Accelerometer, thermometer and gyroscope as the registers set them."""

    def __init__(self, registers: bytearray, part: str, noise_seed: int | None) -> None:
        self._registers = registers
        self._accel_noise = part_noise(f"{part} accelerometer", noise_seed)
        self._gyro_noise = part_noise(f"{part} gyroscope", noise_seed)
        self.accelerometer = TriaxialSensor(ACCEL_START_UP)
        self.thermometer = Sensor(0, 1)
        self.gyroscope = TriaxialSensor(GYRO_START_UP)
        self.sensors: tuple[Sensor, ...] = (self.accelerometer, self.thermometer, self.gyroscope)

    def configure(self, at: int, period: int, *, running: bool) -> None:
        """Take over power, filters, scales and offsets; `period` is the sample period in ns."""
        axes_off = self._registers[PWR_MGMT_2]
        power = self._registers[PWR_MGMT_1]
        self.accelerometer.switch(at, on=running and axes_off >> 3 & 7 != 7)
        self.thermometer.switch(at, on=running and not power & PD_PTAT)
        self.gyroscope.switch(at, on=running and axes_off & 7 != 7 and not power & GYRO_STANDBY)
        self._configure_accelerometer(period)
        self._configure_thermometer(period)
        self._configure_gyroscope(period)
        self._find_ready()

    def skip_start_up(self, at: int) -> None:
        """Have every sensor that is on ready at once, as after a long time."""
        for sensor in self.sensors:
            sensor.skip_start_up(at)
        self._find_ready()

    def switch_off(self, at: int) -> None:
        """Have every sensor stop, as in a reset."""
        for sensor in self.sensors:
            sensor.switch(at, on=False)

    def forget(self, sensors: int) -> None:
        """Clear the filters that these bits of SIGNAL_PATH_RESET name."""
        by_bit = ((1, self.thermometer), (2, self.accelerometer), (4, self.gyroscope))
        for bit, sensor in by_bit:
            if sensors & bit:
                sensor.forget()

    def take(self, at: int, truth: Inertia) -> bool:
        """Let every sensor take one sample; True when all that are switched on are ready."""
        acceleration, temperature = truth.acceleration, (truth.temperature_c,)
        if acceleration != self.accelerometer.values:  # what has settled has nothing to follow
            self.accelerometer.take(at, acceleration)
        if temperature != self.thermometer.values:
            self.thermometer.take(at, temperature)
        self.gyroscope.take(at, truth.rate)
        return at >= self._ready_at

    @property
    def memory(self) -> int:
        """Return the number of samples that the filters remember."""
        return max(sensor.memory for sensor in self.sensors)

    def sample(self, at: int) -> bytes:
        """Return acceleration, temperature and rate of the sample of an instant, in bytes."""
        accelerometer, gyroscope = self.accelerometer, self.gyroscope
        if self._accel_noise is None or self._gyro_noise is None:
            force, rate = accelerometer.counts(), gyroscope.counts()
        else:
            force = accelerometer.noisy_counts(
                _scaled(self._accel_noise.at(at), ACCEL_NOISE_M_S2 * accelerometer.noise)
            )
            rate = gyroscope.noisy_counts(
                _scaled(self._gyro_noise.at(at), GYRO_NOISE_RAD_S * gyroscope.noise)
            )
        return SAMPLE.pack(*force, *self.thermometer.counts(), *rate)

    def _find_ready(self) -> None:
        self._ready_at = max((sensor.ready_at for sensor in self.sensors if sensor.on), default=0)

    def _configure_accelerometer(self, period: int) -> None:
        config, config2 = self._registers[ACCEL_CONFIG], self._registers[ACCEL_CONFIG2]
        range_code = config >> 3 & 3
        delay_ms = ACCEL_BYPASS_DELAY_MS if config2 & 8 else ACCEL_DELAY_MS[config2 & 7]
        scale = FULL_SCALE_COUNTS / ((2 << range_code) * G_M_S2)
        steps = [
            (signed_word(self._registers, XA_OFFSET_H + 3 * axis) >> 1) - (_signed(word) >> 1)
            for axis, word in enumerate(ACCEL_TRIM)
        ]
        bias = _with_self_test(
            [step * ACCEL_OFFSET_LSB / (1 << range_code) for step in steps],
            config,
            ACCEL_SELF_TEST_CODES,
        )
        axes_off = self._registers[PWR_MGMT_2] >> 3
        self.accelerometer.configure(delay_ms, period, *_axes(scale, bias, axes_off))

    def _configure_thermometer(self, period: int) -> None:
        bypassed = self._registers[GYRO_CONFIG] & 3
        delay_ms = TEMPERATURE_DELAY_MS[0 if bypassed else self._registers[CONFIG] & 7]
        zero = -TEMPERATURE_ZERO_C * TEMPERATURE_LSB
        self.thermometer.configure(delay_ms, period, (TEMPERATURE_LSB,), (zero,))

    def _configure_gyroscope(self, period: int) -> None:
        config = self._registers[GYRO_CONFIG]
        range_code, bypass = config >> 3 & 3, config & 3
        filtered_ms = GYRO_DELAY_MS[self._registers[CONFIG] & 7]
        delay_ms = GYRO_BYPASS_DELAY_MS[bypass] if bypass else filtered_ms
        scale = FULL_SCALE_COUNTS / math.radians(250 << range_code)
        offsets = [signed_word(self._registers, XG_OFFSET_H + 2 * axis) for axis in range(3)]
        bias = _with_self_test(
            [offset * 4 / (1 << range_code) for offset in offsets], config, GYRO_SELF_TEST_CODES
        )
        axes_off = self._registers[PWR_MGMT_2]
        self.gyroscope.configure(delay_ms, period, *_axes(scale, bias, axes_off))


def _with_self_test(bias: list[float], config: int, codes: tuple[int, ...]) -> list[float]:
    """Add the deflection of each axis whose self-test bit (7, 6, 5 for X, Y, Z) is set."""
    largest = SELF_TEST_LSB / (1 << (config >> 3 & 3))
    return [
        axis_bias + (largest * SELF_TEST_STEP ** (code - 1) if config & bit else 0.0)
        for axis_bias, code, bit in zip(bias, codes, (0x80, 0x40, 0x20), strict=True)
    ]


def _scaled(triple: tuple[float, float, float], scale: float) -> tuple[float, float, float]:
    x, y, z = triple
    return (x * scale, y * scale, z * scale)


def _axes(scale: float, bias: list[float], off: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return scale and bias of the three axes, 0 for one that is off (bits 2, 1, 0: X, Y, Z)."""
    on = [not off & bit for bit in (4, 2, 1)]
    return tuple(scale * axis for axis in on), tuple(
        axis_bias * axis for axis_bias, axis in zip(bias, on, strict=True)
    )


def _signed(word: int) -> int:
    return word - 0x10000 if word & 0x8000 else word
