"""InvenSense MPU-9250, accelerometer and gyroscope with an AK8963 inside (RM-MPU-9250A rev. 1.6).

The driver identifies the chip, resets and sets it, brings the AK8963 up through the bypass, then
lets the chip's auxiliary master fetch its measurements, so that one burst a sample carries nine
axes, temperature and whether they are new. Samples are in SI units and body axes.

When each part is new. Acceleration and rate: INT_STATUS says so, and a read without a new sample
raises. Field: the master fetches at most 100 times a second (I2C_MST_DLY) and ST1 then says whether
the measurement was new; otherwise the field is None. Between two fetches the chip shows the last
one, so a reader that overtakes the chip's clock may meet the same fetch in two samples.

Whether it lives. A reading that repeats itself beyond what the part's noise allows raises Stuck
(`firmware_drivers.chips.liveness`), of acceleration and rate as of the field, which then is None.
Specific force whose mean over 256 samples is no gravity raises Implausible. A chip that was stuck
has to change before it is believed again, also after a new bring-up.

Not used: FIFO, self-test, wake-on-motion, interrupt pin, offset registers. The gyroscope's bias is
left in (`firmware_drivers.gyro_bias` measures it).
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Final

from firmware_drivers.chips.ak8963 import ADDRESS as AK8963_ADDRESS
from firmware_drivers.chips.ak8963 import MEASUREMENT, ST1, Ak8963
from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.mounting import Vector, parse_mounting
from firmware_drivers.chips.mpu9250_burst import (
    NO_BIAS,
    RAW_RDY_EN,
    STANDARD_GRAVITY,
    BurstDecoder,
    FieldDecoder,
    InertialChecks,
    InertialSample,
)
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, Stuck, WrongDevice

SMPLRT_DIV: Final = 0x19
I2C_MST_CTRL: Final = 0x24
I2C_SLV4_CTRL: Final = 0x34
I2C_MST_STATUS: Final = 0x36
INT_PIN_CFG: Final = 0x37
I2C_MST_DELAY_CTRL: Final = 0x67
USER_CTRL: Final = 0x6A
PWR_MGMT_1: Final = 0x6B
WHO_AM_I: Final = 0x75

H_RESET: Final = 0x80
CLKSEL_BEST: Final = 0x01
ALL_AXES_ON: Final = 0x00
BYPASS_EN: Final = 0x02
I2C_MST_EN: Final = 0x20
MASTER_400_KHZ: Final = 0x0D
SLV_READ: Final = 0x80
SLV_EN: Final = 0x80
DELAY_ES_SHADOW: Final = 0x80
SLV0_DLY_EN: Final = 0x01
SLV0_NACK: Final = 0x01

FETCH_NS: Final = 1_000_000
"""More than the auxiliary master needs to end a fetch under way."""
RESET_NS: Final = 100_000_000
GYROSCOPE_START_NS: Final = 70_000_000

KNOWN: Final = {0x71: "MPU-9250", 0x73: "MPU-9255"}
COMPATIBLE: Final = {
    0x70: "an MPU-6500, sold as MPU-9250 at times",
    0x74: "an MPU-6515",
    0x75: "a nameless variant sold as MPU-9250",
    0x78: "a nameless variant sold as MPU-9250",
}
"""Same registers, no AK8963 inside: taken, with a warning."""
INCOMPATIBLE: Final = {0x68: "an MPU-6050", 0x98: "an ICM-20689"}
"""Other registers or scales: refused by name."""


def without_field(place: str, reason: str) -> str:
    """Return a sentence about a chip that goes on without its magnetometer."""
    return f"{place}: six axes only, without field: {reason}"


class Mpu9250(I2cChip):
    """One MPU-9250. `warnings` has a sentence for all that works less well than it should.

    `has_magnetometer` is True after a bring-up that found the AK8963; without one the driver goes
    on with six axes, says so in `warnings`, and the field of every sample is None.
    """

    chip = "MPU-9250"
    addresses = (0x68, 0x69)

    def __init__(
        self, bus: I2cBus, address: int = 0x68, settings: Mpu9250Settings | None = None
    ) -> None:
        self.settings = settings or Mpu9250Settings()
        super().__init__(bus, address, self.settings.faults())
        self.warnings: list[str] = []
        self.has_magnetometer = False
        self._mounting = parse_mounting(self.settings.mounting)
        self._magnetometer = Ak8963(bus)
        self._checks = InertialChecks(self.place, self.settings)
        self._decoder: BurstDecoder | None = None

    def read_every(self, period_ns: int) -> None:
        """Be told how often it is read: what stands still is counted in readings."""
        self._checks = InertialChecks(self.place, self.settings, period_ns)

    # Bring-up -----------------------------------------------------------------------------------

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to sampling, about 0.2 s.

        The auxiliary master is stopped before the reset: cut off within a fetch, the AK8963, which
        this reset does not reach, could hold its bus indefinitely.
        The steps raise NoAcknowledge, WrongDevice or NotReady.
        """
        fetch_ns = (1 + self.settings.samples_a_fetch()) * 1_000_000_000 // self.settings.sample_hz
        return (
            Step("identify", self.identify, 0),
            Step("stop auxiliary master", partial(self._write, USER_CTRL, 0), FETCH_NS),
            Step("reset", partial(self._write, PWR_MGMT_1, H_RESET), RESET_NS),
            Step(
                "wake",
                partial(self._write, PWR_MGMT_1, CLKSEL_BEST, ALL_AXES_ON),
                0,
            ),
            Step(
                "configure",
                partial(self._write, SMPLRT_DIV, *self.settings.registers()),
                GYROSCOPE_START_NS,
            ),
            Step("open bypass", self._open_bypass, 0),
            *map(self._magnetometer_step, self._magnetometer.bring_up()),
            Step("close bypass", self.close_bypass, 0),
            Step("start auxiliary master", self._start_auxiliary_master, fetch_ns),
            Step("verify", self._verify_and_start, 0),
        )

    def identify(self) -> None:
        """Check WHO_AM_I; an unknown value is refused unless the settings vouch for it.

        Raises NoAcknowledge if nothing answers, WrongDevice if another chip does.
        """
        self.warnings.clear()
        self._decoder = None
        with self._must_answer("WHO_AM_I 71"):
            found = self._read(WHO_AM_I)[0]
        if found in KNOWN:
            return
        if found in COMPATIBLE or found in self.settings.also_accept:
            who = COMPATIBLE.get(found, "accepted by the settings")
            self.warnings.append(f"{self.place}: WHO_AM_I reads {found:02x}, {who}")
            return
        who = INCOMPATIBLE.get(found, "an unknown chip")
        raise self._wrong_device(f"WHO_AM_I reads {found:02x}, {who}", "71 (or 73, 70, 74, 75, 78)")

    def verify(self) -> None:
        """Check that rate, filters and ranges still are as set; one transaction, 75 bits.

        Raises NotReady if not: a chip that was reset goes on sampling, at other scales.
        """
        found = self._read(SMPLRT_DIV, 5)
        expected = self.settings.registers()
        if found != expected:
            what = f"registers 19 to 1d read {found.hex(' ')}"
            raise self._was_changed(what, expected.hex(" "))

    def open_bypass(self) -> tuple[Step, ...]:
        """Give the steps that let the bus see the AK8963 at 0x0C, for a driver of its own.

        The auxiliary master is stopped and the last bring-up is undone: samples are refused.
        The steps raise NoAcknowledge or WrongDevice.
        """
        return (
            Step("identify", self.identify, 0),
            Step("stop auxiliary master", partial(self._write, USER_CTRL, 0), FETCH_NS),
            Step("open bypass", self._open_bypass, 0),
        )

    def close_bypass(self) -> None:
        """Hide the AK8963 from the bus again."""
        self._write(INT_PIN_CFG, 0)

    # Samples ------------------------------------------------------------------------------------

    def read_sample(self, rate_bias: Vector = NO_BIAS) -> InertialSample:
        """Read one sample: specific force in m/s2, rate in rad/s, field in T, in body axes.

        `rate_bias`, in rad/s and body axes, is subtracted from the rate.
        One burst of 26 bytes on the wire, 0.59 ms at 400 kHz; 20 bytes without magnetometer.
        Raises NotReady before bring-up, if there is no sample since the last read, or if the bytes
        cannot be one; Stuck or Implausible if a sensor is dead; and the errors of the bus.
        """
        decoder = self._decoder
        if decoder is None:
            raise self._not_ready("read before bring-up", "it brought up first")
        burst = self._bus.transaction(self.address, decoder.messages)
        return decoder.decode(burst, self._checks, rate_bias)

    @property
    def stuck_field(self) -> Stuck | None:
        """Return the reason for no field where the magnetometer's last measurement stands still."""
        stuck = self._checks.stuck_field
        return None if stuck is None or not self.has_magnetometer else Stuck(self.place, *stuck)

    def check_magnetometer(self) -> bool:
        """Return whether the AK8963 still acknowledges; 39 bits.

        Worth asking when the field is stuck: the chip itself goes on showing the last one.
        """
        return not self._read(I2C_MST_STATUS, 1)[0] & SLV0_NACK

    # Parts of the bring-up ----------------------------------------------------------------------

    def _magnetometer_step(self, step: Step) -> Step:
        action = partial(self._try_magnetometer, step.action)
        return Step(f"magnetometer: {step.name}", action, step.wait_ns)

    def _try_magnetometer(self, action: Callable[[], None]) -> None:
        if not self.has_magnetometer:
            return
        try:
            action()
        except (NoAcknowledge, WrongDevice, NotReady) as error:
            self._give_up_magnetometer(str(error))

    def _give_up_magnetometer(self, reason: str) -> None:
        self.has_magnetometer = False
        self.warnings.append(without_field(self.place, reason))

    def _open_bypass(self) -> None:
        self._write(INT_PIN_CFG, BYPASS_EN, RAW_RDY_EN)
        self.has_magnetometer = True

    def _start_auxiliary_master(self) -> None:
        if not self.has_magnetometer:
            return
        slave_0 = (SLV_READ | AK8963_ADDRESS, ST1, SLV_EN | MEASUREMENT.size)
        self._write(I2C_MST_CTRL, MASTER_400_KHZ, *slave_0)
        self._write(I2C_SLV4_CTRL, self.settings.samples_a_fetch() - 1)
        self._write(I2C_MST_DELAY_CTRL, DELAY_ES_SHADOW | SLV0_DLY_EN)
        self._write(USER_CTRL, I2C_MST_EN)

    def _verify_and_start(self) -> None:
        self.verify()
        self._start_decoding()

    def _start_decoding(self) -> None:
        self._checks.restart()
        field = None
        if self.has_magnetometer:
            field = FieldDecoder.of(self.place, self._mounting, self._magnetometer.sensitivity)
        self._decoder = BurstDecoder.of(
            self.place,
            self._mounting,
            acceleration_range=self.settings.accel_range_g * STANDARD_GRAVITY,
            rate_range=math.radians(self.settings.gyro_range_dps),
            field=field,
        )
