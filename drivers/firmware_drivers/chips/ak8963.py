"""Asahi Kasei AK8963, the magnetometer die inside an MPU-9250 (data sheet MS1356-E-02).

The driver checks the identity, resets the chip, reads the sensitivity of its axes from the fuse ROM
and leaves it measuring 100 times a second in 16 bits. It also reads single measurements, in the
chip's own axes.

It speaks to a chip that the bus can see; behind an MPU-9250 that needs bypass, which is that
driver's part, as is fetching measurements through the auxiliary master. Self-test, 14-bit output
and the other modes are not used. Hard and soft iron of the robot are the models' business.
"""

import struct
from functools import partial
from typing import Final

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.mounting import Vector
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus

ADDRESS: Final = 0x0C
IDENTITY: Final = 0x48
MEASUREMENT_HZ: Final = 100

WIA: Final = 0x00
ST1: Final = 0x02
CNTL1: Final = 0x0A
CNTL2: Final = 0x0B
ASAX: Final = 0x10

DRDY: Final = 0x01
HOFL: Final = 0x08
BITM: Final = 0x10
SRST: Final = 0x01
POWER_DOWN: Final = 0x00
FUSE_ROM: Final = 0x0F
CONTINUOUS_100_HZ_16_BIT: Final = 0x16

MODE_CHANGE_NS: Final = 100_000
FIRST_MEASUREMENT_NS: Final = 10_000_000
"""One period of 100 Hz; a conversion takes 7.2 ms, 9 ms at most."""
TESLA_PER_COUNT: Final = 0.15e-6

MEASUREMENT: Final = struct.Struct("<B3hB")
"""ST1, HX, HY, HZ, ST2. Reading ST2 last frees the chip for its next measurement."""


def sensitivity_of(asa: bytes) -> Vector:
    """Tesla per count of each axis, by the three adjustment bytes of the fuse ROM."""
    x, y, z = (TESLA_PER_COUNT * (adjustment + 128) / 256 for adjustment in asa)
    return (x, y, z)


class Ak8963(I2cChip):
    """One AK8963; `sensitivity`, in tesla per count, is an unadjusted part's before bring-up."""

    chip = "AK8963"
    addresses = (ADDRESS,)

    def __init__(self, bus: I2cBus, address: int = ADDRESS) -> None:
        super().__init__(bus, address)
        self.sensitivity: Vector = sensitivity_of(b"\x80\x80\x80")

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to measuring; modes change by way of power-down.

        The steps raise NoAcknowledge, WrongDevice or NotReady.
        """
        return (
            Step("identify", self.identify, 0),
            Step("reset", partial(self._write, CNTL2, SRST), MODE_CHANGE_NS),
            Step("open fuse ROM", partial(self._write, CNTL1, FUSE_ROM), MODE_CHANGE_NS),
            Step("read sensitivity", self._read_sensitivity, 0),
            Step("power down", partial(self._write, CNTL1, POWER_DOWN), MODE_CHANGE_NS),
            Step(
                "measure",
                partial(self._write, CNTL1, CONTINUOUS_100_HZ_16_BIT),
                FIRST_MEASUREMENT_NS,
            ),
            Step("verify", self.verify, 0),
        )

    def identify(self) -> None:
        """Check WIA. Raises NoAcknowledge if nothing answers, WrongDevice if another chip does."""
        expected = f"WIA {IDENTITY:02x}; behind an MPU-9250 it shows in bypass only"
        with self._must_answer(expected):
            found = self._read(WIA)[0]
        if found != IDENTITY:
            raise self._wrong_device(f"WIA reads {found:02x}", f"{IDENTITY:02x}")

    def verify(self) -> None:
        """Check that it still measures as brought up. Raises NotReady, as after a brown-out."""
        found = self._read(CNTL1, 1)[0]
        if found != CONTINUOUS_100_HZ_16_BIT:
            raise self._not_ready(f"CNTL1 reads {found:02x}", f"{CONTINUOUS_100_HZ_16_BIT:02x}")

    def read_field(self) -> Vector:
        """Read one measurement: field in T, in the chip's axes; 11 bytes, 0.26 ms at 400 kHz.

        Raises NotReady if there is none since the last read, or the field is beyond 4912 uT.
        """
        st1, hx, hy, hz, st2 = MEASUREMENT.unpack(self._read(ST1, MEASUREMENT.size))
        if not st1 & DRDY:
            raise self._not_ready("no new measurement", f"{MEASUREMENT_HZ} a second")
        if st2 & (HOFL | BITM) != BITM:
            raise self._not_ready(f"ST2 reads {st2:02x}", f"{BITM:02x} (16 bits, no overflow)")
        x, y, z = self.sensitivity
        return (hx * x, hy * y, hz * z)

    def _read_sensitivity(self) -> None:
        asa = self._read(ASAX, 3)
        if asa in (bytes(3), b"\xff" * 3):
            raise self._not_ready(f"fuse ROM reads {asa.hex(' ')}", "three factors")
        self.sensitivity = sensitivity_of(asa)
