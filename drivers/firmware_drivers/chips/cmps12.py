"""Devantech CMPS12 and CMPS14 tilt-compensated compasses on I2C (Devantech, CMPS12 documentation).

The driver reads bearing, inclination and raw magnetometer in one burst, and the chip's judgement of
its own calibration. It calibrates by itself while it is moved; a fresh one must be turned about
before its bearing means anything; only the calibration state shows when.

The registers read have the same places in a CMPS11, but for the calibration state; CMPS09 and
CMPS10 have neither that nor the magnetometer there. None has an identity register: a chip is known
by its bearing, which it gives twice, in 8 and in 16 bits. It is left as found: nothing is written,
stored profiles and address included.

It may stretch the clock, which a Pi's I2C handles badly.

A bearing may stand still, for what computes it is a filter; the raw field never does. It is new
twenty times a second, with 0.6 uT of noise in steps of 0.3 uT (data sheets of Bosch's BMM150 and
BNO055), so a chip whose field repeats itself beyond chance is reported as stuck.
"""

import struct
from typing import Final

from firmware_drivers.chips.bearing import Bearing
from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.liveness import Liveness
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import Implausible

ADDRESSES: Final = range(0x60, 0x68)
SHIPPED_AT: Final = 0x60
"""Address of the PCA9685 on motor boards: beside one, give the compass another."""

VERSION: Final = 0x00
CALIBRATION: Final = 0x1E

IDENTITY: Final = struct.Struct(">BBH")
"""Software version, bearing in 256ths of a circle, bearing in tenths of a degree."""
READING: Final = struct.Struct(">BBH2x3h")
"""Version, 256ths, bearing; then pitch, roll and three axes of magnetometer."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((VERSION,)), READING.size),
    (bytes((CALIBRATION,)), 1),
)
"""Transactions of one reading, for the bus-time budget."""
CIRCLE: Final = 3600
NO_VERSION: Final = (0x00, 0xFF)
"""Values read when SDA is held low, or when no chip drives it."""
MOST_APART: Final = 42
"""Tenths of a degree between the two bearings: rounding, and one refresh while turning fast."""
MAGNETOMETER_STATE: Final = 0x03
FIELD_AXES: Final = ("field x", "field y", "field z")
FIELD_PERIOD_NS: Final = 50_000_000
FRESH_STEPS: Final = 0.9
"""Less than half of the field's noise, in the steps that it is measured in: no bit is one alone."""


class Cmps12(I2cChip):
    """One CMPS12 or CMPS14. `measurement` is empty: a bearing can be read at any time.

    `period_ns` is the least time between two readings: a field that is read more often than it is
    measured repeats itself.
    """

    chip = "CMPS12"
    addresses = ADDRESSES
    measurement: tuple[Step, ...] = ()

    def __init__(
        self, bus: I2cBus, address: int = SHIPPED_AT, *, period_ns: int = 10_000_000
    ) -> None:
        super().__init__(bus, address)
        repeats = max(1, -(-FIELD_PERIOD_NS // period_ns))
        self._liveness = Liveness(self.place, FIELD_AXES, (FRESH_STEPS,) * 3, repeats=repeats)

    def bring_up(self) -> tuple[Step, ...]:
        """Give the one step there is; it raises NoAcknowledge or WrongDevice."""
        return (Step("identify", self.identify, 0),)

    def identify(self) -> None:
        """Check that both bearings are one and the same direction, and that there is a version.

        Raises NoAcknowledge if nothing answers, WrongDevice if another chip does: a PCA9685 on a
        motor board has 0x60 too, and reads e2 e4 where the bearing should be.
        """
        self._liveness.restart()
        with self._must_answer("a software version"):
            found = self._read(VERSION, IDENTITY.size)
        version, coarse, fine = IDENTITY.unpack(found)
        if version in NO_VERSION or fine >= CIRCLE or _are_apart(coarse, fine):
            raise self._wrong_device(
                f"registers 0 to 3 read {found.hex(' ')}, expected a version and the "
                "same bearing twice; another device answers here"
            )

    def read_bearing(self) -> Bearing:
        """Read the bearing, in degrees to 0.1, with the calibration state.

        Two transactions, 19 bytes, 0.44 ms at 400 kHz.
        Raises NotReady if the bytes cannot be a bearing, Implausible if its two forms differ, Stuck
        if the field stands still, NoAcknowledge if the chip is gone.
        """
        found = self._read(VERSION, READING.size)
        state = self._read(CALIBRATION, 1)[0]
        version, coarse, tenths, *field = READING.unpack(found)
        if version in NO_VERSION:
            raise self._not_ready(
                f"software version reads {version:02x}, expected 01 to fe; a line is "
                "held, or no chip drives it"
            )
        if tenths >= CIRCLE:
            raise self._not_ready(f"bearing reads {tenths}", f"0 to {CIRCLE - 1}")
        if _are_apart(coarse, tenths):
            expected = f"{coarse * 360 / 256:.1f} degrees, as its 256ths say"
            raise Implausible(self.place, "bearing", tenths / 10, expected)
        self._liveness.check(tuple(field))
        return Bearing(tenths / 10, state & MAGNETOMETER_STATE)


def _are_apart(coarse: int, fine: int) -> bool:
    """Return whether a bearing in 256ths and one in tenths of a degree are two directions."""
    apart = (coarse * CIRCLE // 256 - fine + CIRCLE // 2) % CIRCLE - CIRCLE // 2
    return abs(apart) > MOST_APART
