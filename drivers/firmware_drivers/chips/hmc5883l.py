"""Honeywell HMC5883L magnetometer as a compass (Honeywell HMC5883L data sheet, form 900405).

The driver identifies the chip, sets its range, and takes single measurements, the mean of eight
samples each. The mode register goes idle when one is done, so an old one is never taken for new;
and writing the mode frees data registers that an interrupted read left locked. Every reading brings
the settings with it, so a loss of power is detected at once, not read at another scale.

The bearing is the direction of the field in the body's horizontal plane, so it is right only while
the robot stands level. Iron of the robot that turns with it is taken off (`hard_iron`), soft iron
and declination are not. Not used: continuous mode, self-test, the DRDY pin.

Every measurement has its noise, 2 mG in the mean of eight samples by the data sheet: data that
repeat themselves beyond chance are reported as stuck (`firmware_drivers.chips.liveness`).

Many boards sold as HMC5883L carry other chips at other addresses; if one answers it is named.
"""

import math
import struct
from dataclasses import dataclass
from functools import partial
from typing import Final

from firmware_drivers.chips.bearing import Bearing, in_circle
from firmware_drivers.chips.i2c_chip import I2cChip, choice_fault
from firmware_drivers.chips.liveness import Liveness
from firmware_drivers.chips.mounting import Vector, parse_mounting
from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import HalError, Implausible, NoAcknowledge
from firmware_runtime.system.elementary import atan2, hypot

ADDRESS: Final = 0x1E
IDENTITY: Final = b"H43"
CLONES: Final = {0x0D: "a QMC5883L", 0x2C: "a QMC5883P"}

CRA: Final = 0x00
MODE: Final = 0x02
IDENTITY_A: Final = 0x0A

EIGHT_SAMPLES_NO_BIAS: Final = 0x70
SINGLE: Final = 0x01
IDLE: Final = 0x02
"""Set in both idle codes of MODE; the datasheet does not say which one a measurement ends in."""
MEASUREMENT_NS: Final = 10_000_000
"""A measurement takes 6 ms; the rest is room."""

READING: Final = struct.Struct(">3B3h")
"""CRA, CRB, MODE, then X, Z, Y in this order; all six data bytes, so nothing stays locked."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((MODE, SINGLE)),),
    (bytes((CRA,)), READING.size),
)
"""Transactions of one measurement, start and reading, for the bus-time budget."""
OVERFLOW: Final = -4096
LEAST, LARGEST = -2048, 2047
"""Counts of its converter, which has 12 bits."""
COUNTS_PER_GAUSS: Final = {
    0.88: 1370,
    1.3: 1090,
    1.9: 820,
    2.5: 660,
    4.0: 440,
    4.7: 390,
    5.6: 330,
    8.1: 230,
}
"""By range in gauss, in the order of the gain codes."""
TESLA_PER_GAUSS: Final = 1e-4
FRESH_GAUSS: Final = 1e-3
"""Half of the typical noise of a measurement."""
FIELD_AXES: Final = ("field x", "field y", "field z")
LEAST_HORIZONTAL_T: Final = 2e-6
"""The Earth's horizontal field is some 10 uT near the poles, 20 in Europe, 40 at the equator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hmc5883lSettings:
    """Range, mounting and the robot's own field; any may be wrong until `faults` was checked."""

    range_gauss: float = 1.3
    mounting: str = "+x +y +z"
    """Axes along body x (forward), y (left), z (up): see `firmware_drivers.chips.mounting`."""
    hard_iron: Vector = (0.0, 0.0, 0.0)
    """The field the robot carries with it, in T, body axes."""

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        faults = choice_fault("range_gauss", self.range_gauss, COUNTS_PER_GAUSS)
        if not all(map(math.isfinite, self.hard_iron)):
            faults.append(f"hard_iron: {self.hard_iron} T, expected three finite numbers")
        try:
            parse_mounting(self.mounting)
        except SettingError as error:
            faults.append(str(error))
        return tuple(faults)

    def registers(self) -> tuple[int, int]:
        """Give the contents of CRA and CRB."""
        return (EIGHT_SAMPLES_NO_BIAS, list(COUNTS_PER_GAUSS).index(self.range_gauss) << 5)


class Hmc5883l(I2cChip):
    """One HMC5883L: take the steps of `measurement`, then read it, once."""

    chip = "HMC5883L"
    addresses = (ADDRESS,)

    def __init__(self, bus: I2cBus, settings: Hmc5883lSettings | None = None) -> None:
        self.settings = settings or Hmc5883lSettings()
        super().__init__(bus, ADDRESS, self.settings.faults())
        self.measurement = (Step("measure", self._start_measurement, MEASUREMENT_NS),)
        self._is_measuring = False
        self._registers = self.settings.registers()
        fresh = FRESH_GAUSS * COUNTS_PER_GAUSS[self.settings.range_gauss]
        self._liveness = Liveness(self.place, FIELD_AXES, (fresh,) * 3)
        scale = TESLA_PER_GAUSS / COUNTS_PER_GAUSS[self.settings.range_gauss]
        mounting = parse_mounting(self.settings.mounting)
        self._axes = mounting.axes
        self._factors = mounting.factors((scale, scale, scale))

    # Bring-up -----------------------------------------------------------------------------------

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready; they raise NoAcknowledge, WrongDevice, NotReady.

        One measurement is thrown away: the first after a change of range still has the old one.
        """
        return (
            Step("identify", self.identify, 0),
            Step("configure", partial(self._write, CRA, *self._registers), 0),
            *self.measurement,
            Step("discard", self._discard, 0),
        )

    def identify(self) -> None:
        """Check the identity; without an answer look for the chips sold under this name.

        Raises NoAcknowledge, naming what answers elsewhere, or WrongDevice.
        """
        self._is_measuring = False
        self._liveness.restart()
        try:
            found = self._read(IDENTITY_A, len(IDENTITY))
        except NoAcknowledge as error:
            raise NoAcknowledge(
                "no answer", where=self.place, expected=f"the identity 48 34 33{self._others()}"
            ) from error
        if found != IDENTITY:
            raise self._wrong_device(f"identity reads {found.hex(' ')}", "48 34 33 (H43)")

    def verify(self) -> None:
        """Check that range and averaging still are as set. Raises NotReady if not."""
        self._compare(tuple(self._read(CRA, 2)))

    # Measurements -------------------------------------------------------------------------------

    def read_field(self) -> Vector:
        """Read the measurement started last: field in T, body axes, hard iron taken off.

        One burst of 12 bytes, 0.28 ms at 400 kHz.
        Raises NotReady if none was started or it is not done, if an axis is beyond the range, or if
        the chip was reset; Implausible for counts that its converter has not; Stuck if the data
        stand still; NoAcknowledge if it is gone.
        """
        return self._read_measurement()

    def read_bearing(self) -> Bearing:
        """Read the same as a bearing, in degrees clockwise from magnetic north.

        Raises as `read_field` does, and NotReady if the field has no horizontal part to speak of.
        """
        forward, left, _ = self._read_measurement()
        horizontal = hypot(forward, left)
        if horizontal < LEAST_HORIZONTAL_T:
            raise self._not_ready(
                f"horizontal field is {horizontal * 1e6:.1f} uT",
                f"{LEAST_HORIZONTAL_T * 1e6:g} uT or more for a bearing",
            )
        return Bearing(in_circle(math.degrees(atan2(left, forward))), None)

    # ---------------------------------------------------------------------------------------------

    def _start_measurement(self) -> None:
        self._is_measuring = False
        self._write(MODE, SINGLE)
        self._is_measuring = True

    def _discard(self) -> None:
        self._read_counts()

    def _read_measurement(self) -> Vector:
        counts = self._read_counts()
        if OVERFLOW in counts:
            axes = ", ".join(
                axis for axis, count in zip("xyz", counts, strict=True) if count == OVERFLOW
            )
            raise self._not_ready(
                f"field beyond the range on sensor axis {axes}",
                f"within {self.settings.range_gauss} G",
            )
        for axis, count in zip(FIELD_AXES, counts, strict=True):
            if not LEAST <= count <= LARGEST:
                raise Implausible(self.place, axis, count, f"{LEAST} to {LARGEST} counts")
        self._liveness.check(counts)
        x, y, z = (
            factor * counts[axis] - iron
            for factor, axis, iron in zip(
                self._factors, self._axes, self.settings.hard_iron, strict=True
            )
        )
        return (x, y, z)

    def _read_counts(self) -> tuple[int, int, int]:
        """Read a finished measurement, counts by sensor axis x, y, z."""
        if not self._is_measuring:
            raise self._not_ready("no measurement to read", "one started, not read")
        cra, crb, mode, x, z, y = READING.unpack(self._read(CRA, READING.size))
        self._compare((cra, crb))
        if not mode & IDLE:
            raise self._not_ready(f"MODE reads {mode:02x}", "02 or 03, a measurement done")
        self._is_measuring = False
        return (x, y, z)

    def _compare(self, found: tuple[int, ...]) -> None:
        if found != self._registers:
            expected = bytes(self._registers).hex(" ")
            raise self._was_changed(f"CRA, CRB read {bytes(found).hex(' ')}", expected)

    def _others(self) -> str:
        """Name the chips that answer at the addresses of those sold as an HMC5883L."""
        found = [
            f"0x{at:02x} answers, likely {who}" for at, who in CLONES.items() if self._is_at(at)
        ]
        return f"; {', '.join(found)}, which this driver cannot read" if found else ""

    def _is_at(self, address: int) -> bool:
        try:
            self._bus.read(address, 1)
        except HalError:
            return False
        return True
