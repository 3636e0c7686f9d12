"""Double of the Honeywell HMC5883L, a 3-axis magnetometer on I2C. Source: Honeywell data sheet E.

Modelled: identity, single and continuous measuring with their times, gain, the order X, Z, Y,
overflow (-4096) by axis, LOCK, RDY, self-test bias, both pointer loops, and that the first
measurement after a change of gain still has the old one.

Noise is the data sheet's, 2 mG of eight samples averaged. Not modelled: the DRDY pin; high-speed
I2C. Assumed where the data sheet is silent: the field is taken when its measurement ends; the first
one ends 6 ms after MODE or CRA was written, the following ones at the rate; idle after a single one
reads as 2; the single measurement of the power-up value of MODE is carried out; RDY is 0 in the 250
us before new data; in self-test the data are the bias alone, since the external field is
subtracted; a reserved rate or bias measures nothing.
"""

import math
from collections.abc import Callable
from struct import Struct

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Words
from sim_doubles.inertial_truth import Vector
from sim_doubles.worlds.noise import part_noise

ADDRESS = 0x1E

CRA = 0x00
CRB = 0x01
MODE = 0x02
DXRA = 0x03
DYRB = 0x08
STATUS = 0x09
IDENTIFICATION = 0x0A
REGISTERS = 0x0D

CONTINUOUS, SINGLE, IDLE = 0, 1, 2  # MODE
RDY, LOCK = 0x01, 0x02  # STATUS

CONVERSION = 6 * MILLISECOND
NOT_READY = 250 * MICROSECOND
PERIODS = (  # 0.75, 1.5, 3, 7.5, 15, 30, 75 Hz, reserved
    *(1_333_333_333, 666_666_667, 333_333_333, 133_333_333),
    *(66_666_667, 33_333_333, 13_333_333, NEVER),
)
LSB_PER_GAUSS = (1370, 1090, 820, 660, 440, 390, 330, 230)
GAUSS_PER_T = 1e4
NOISE_T = 2e-7  # of eight samples averaged
SELF_TEST_GAUSS = (1.16, 1.16, 1.08)
LEAST, LARGEST, OVERFLOW = -2048, 2047, -4096

POWER_UP = bytes([0x10, 0x20, 0x01, *bytes(7), *b"H43"])
RESERVED = (0x80, 0x1F, 0x7C)  # bits of CRA, CRB and MODE that must be 0
DATA = Struct(">3h")
ALL_READ = 0b111111


class Hmc5883lDouble(RegisterTarget):
    """An HMC5883L at 0x1E; `field` gives the flux density in T at an instant (ns), in its axes.

    A plant whose state depends on the host's writes must see every measurement that ended before
    it moves on: call `catch_up` first. `noise_seed` chooses the noise; None for exact values. From
    `hangs_from` on, an instant in ns, its data stay as they are, whatever is measured.
    """

    measured = (Words(3, 3),)

    def __init__(
        self, now: Now, field: Callable[[int], Vector], *, noise_seed: int | None = 1
    ) -> None:
        super().__init__(now, ADDRESS)
        self.warnings = ProtocolWarnings("HMC5883L")
        self.hangs_from = NEVER
        self._field = field
        self._noise = part_noise("HMC5883L", noise_seed, NOISE_T)
        self._registers = bytearray(POWER_UP)
        self._lands_at = NEVER
        self._read = 0  # the data registers read since all six were, a bit each
        self._reset()

    def catch_up(self) -> None:
        """Carry out the measurements that have ended by now; only the last leaves a trace."""
        self._at = self._now()
        if self._at < self._lands_at:
            return
        if self._mode == SINGLE:
            self._land(self._lands_at)
            self._registers[MODE] = self._registers[MODE] & ~0x03 | IDLE
            self._lands_at = NEVER
            return
        since = (self._at - self._lands_at) % self._period
        if self._at - since > self._lands_at:
            self._gain = self._next_gain
        self._land(self._at - since)
        self._lands_at = self._at - since + self._period

    # Bus face

    def _begin(self) -> None:
        self.catch_up()

    def _after(self, register: int) -> int:
        """After the data comes the data again, after the identity register 0."""
        if register == DYRB:
            return DXRA
        return 0 if register >= REGISTERS - 1 else register + 1

    def _read_register(self, register: int) -> int:
        if register == STATUS:
            return self._status()
        if DXRA <= register <= DYRB:
            self._read |= 1 << register - DXRA
            self._ready = False
            if self._read == ALL_READ:
                self._read = 0
        return self._registers[register] if register < REGISTERS else 0

    def _write_register(self, register: int, byte: int) -> None:
        if register > MODE:
            self.warnings.note(f"register 0x{register:02x} is read-only; the write is ignored")
            return
        if byte & RESERVED[register]:
            self.warnings.note(
                f"register 0x{register:02x} written 0x{byte:02x}; its reserved bits must be 0"
            )
        self._registers[register] = byte & ~RESERVED[register]
        if register == CRB:
            self._next_gain = byte >> 5
        else:
            self._read = 0
            self._begin_measuring()

    # Measuring

    @property
    def _mode(self) -> int:
        return self._registers[MODE] & 0x03

    @property
    def _period(self) -> int:
        return PERIODS[self._registers[CRA] >> 2 & 0x07]

    @property
    def _bias(self) -> int:
        return self._registers[CRA] & 0x03

    def _reset(self) -> None:
        """Take the power-up values: one measurement, then idle."""
        self._registers[:] = POWER_UP
        self._gain = self._next_gain = POWER_UP[CRB] >> 5
        self._ready = False
        self._read = 0
        self._begin_measuring()

    def _begin_measuring(self) -> None:
        self._lands_at = NEVER
        if self._period == NEVER or self._bias == 3:
            self.warnings.note("reserved rate or bias in CRA; this double measures nothing")
        elif self._mode <= SINGLE:
            self._lands_at = self._at + CONVERSION

    def _status(self) -> int:
        if self._read:
            return LOCK
        being_written = self._at >= self._lands_at - NOT_READY
        return RDY if self._ready and not being_written else 0

    def _land(self, at: int) -> None:
        """Put a measurement into the data registers; while they are locked it is lost."""
        gain, self._gain = self._gain, self._next_gain
        if self._read:
            return
        self._ready = True
        if at >= self.hangs_from:
            return
        x, y, z = (_counts(gauss, gain) for gauss in self._measured_gauss(at))
        self._registers[DXRA : DYRB + 1] = DATA.pack(x, z, y)

    def _measured_gauss(self, at: int) -> Vector:
        if self._bias:
            sign = 1 if self._bias == 1 else -1
            x, y, z = SELF_TEST_GAUSS
            return sign * x, sign * y, sign * z
        x, y, z = self._field(at)
        if self._noise is not None:
            share = math.sqrt(8 >> (self._registers[CRA] >> 5 & 0x03))
            noise_x, noise_y, noise_z = self._noise.at(at)
            x, y, z = x + share * noise_x, y + share * noise_y, z + share * noise_z
        return x * GAUSS_PER_T, y * GAUSS_PER_T, z * GAUSS_PER_T


def _counts(gauss: float, gain: int) -> int:
    counts = round(gauss * LSB_PER_GAUSS[gain])
    return counts if LEAST <= counts <= LARGEST else OVERFLOW
