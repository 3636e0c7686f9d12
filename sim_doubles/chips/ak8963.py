"""Double of the AKM AK8963, the magnetometer die in an MPU-9250. Source: AKM MS1356-E-02.

Modelled: identity, the measuring modes with their times, DRDY, DOR, the protection of data until
ST2 is read (in continuous modes; single measurement and self-test have none), a new measurement
when a continuous mode is set again, overflow, 14 and 16 bit, fuse ROM, soft reset, I2CDIS, both
pointer loops, and the axes: X along the MPU's Y, Y along its X, Z against its Z.

Not modelled: external trigger mode (warned of, never measures), the test registers. Assumed where
the data sheet is silent: the sensitivity registers read 0 outside fuse ROM mode; changing the mode
without power-down works and is warned of; setting a mode ends the protection of data; the field is
taken when its conversion ends; self-test gives a fixed value inside the limits of the data sheet
(16-bit X and Y +-200, Z -3200 to -800).

The die sits on the auxiliary bus of its MPU. The host reaches it when that bus is switched through,
see `host_reaches`; a die on a board of its own always answers.
"""

from collections.abc import Callable
from struct import Struct

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import Vector
from sim_doubles.worlds.noise import part_noise

ADDRESS = 0x0C

WIA = 0x00
INFO = 0x01
ST1 = 0x02
HXL = 0x03
ST2 = 0x09
CNTL1 = 0x0A
CNTL2 = 0x0B
ASTC = 0x0C
I2CDIS = 0x0F
ASAX = 0x10
ASAZ = 0x12

DRDY, DOR = 0x01, 0x02  # ST1
HOFL, BITM = 0x08, 0x10  # ST2
SRST = 0x01  # CNTL2
SELF = 0x40  # ASTC
I2C_DISABLED = 0x1B  # I2CDIS

POWER_DOWN = 0x0
SINGLE = 0x1
CONTINUOUS_1 = 0x2
CONTINUOUS_2 = 0x6
SELF_TEST = 0x8
FUSE_ROM = 0xF
MEASURING = frozenset({SINGLE, CONTINUOUS_1, CONTINUOUS_2, SELF_TEST})
MODES = MEASURING | {POWER_DOWN, FUSE_ROM}

CONVERSION = 7_200 * MICROSECOND
PERIODS = {CONTINUOUS_1: 125 * MILLISECOND, CONTINUOUS_2: 10 * MILLISECOND}
MODE_CHANGE_WAIT = 100 * MICROSECOND
START_UP = 100 * MICROSECOND

COARSE, FINE = (0.6e-6, 8190), (0.15e-6, 32760)  # T per LSB and largest value, 14 and 16 bit
OVERFLOW_T = 4912e-6
NOISE_T = 0.3e-6  # the data sheet states none; what users measure
SELF_TEST_T = (30 * 0.15e-6, -40 * 0.15e-6, -1800 * 0.15e-6)

DATA = Struct("<3h")
NEXT = bytes([*range(1, 0x0D), 0, 0x0E, 0x0F, 0x10, 0x11, 0x12, 0x10, *range(0x14, 0x100), 0])


class Ak8963Double(Target):
    """An AK8963; `field` gives the flux density in T at an instant (ns), in the MPU's axes.

    `asa` are the factory sensitivity values. `noise_seed` chooses the noise; None where the field
    is noisy already, or a test wants exact values. `host_reaches` returns whether the host's bus is
    switched through to the die, once its MPU has taken every sample due by now; `Mpu9250Double`
    sets it.
    """

    def __init__(
        self,
        now: Now,
        field: Callable[[int], Vector],
        *,
        asa: tuple[int, int, int] = (176, 177, 164),
        noise_seed: int | None = 1,
    ) -> None:
        self.host_reaches: Callable[[], bool] | None = None
        self.warnings = ProtocolWarnings("AK8963")
        self._now = now
        self._field = field
        self._asa = asa
        self._noise = part_noise("AK8963", noise_seed, NOISE_T)
        self._registers = bytearray(256)
        self._pointer = 0
        self._in_transaction = self._expects_pointer = self._is_hosts = False
        self._at = self._answers_from = self._mode_allowed_at = now()
        self.lands_at = NEVER
        """End of the conversion under way: until then `advance` may be left out."""
        self._reset()

    def power_cycle(self) -> None:
        """Lose supply and get it back: powered down, deaf for 100 us."""
        self._at = self._now()
        self._answers_from = self._at + START_UP
        self._reset()

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the host at 0x0C where it can reach the die."""
        if address != ADDRESS:
            return False
        if self._in_transaction:
            return self._open(read=read)
        if not self._is_reached():
            return False
        self.advance(self._now())
        self._is_hosts = True
        return self._open(read=read)

    def start_from_mpu(self, at: int, address: int, *, read: bool) -> bool:
        """Answer the MPU's auxiliary master, whose transaction happens at `at`."""
        if address != ADDRESS or not self.is_connected:
            return False
        self.advance(at)
        self._is_hosts = False
        return self._open(read=read)

    def read_from_mpu(
        self, at: int, address: int, register: int | None, length: int
    ) -> bytes | None:
        """Answer a whole read of the master's: pointer if any, repeated START, bytes, STOP."""
        if not self.start_from_mpu(at, address, read=True):
            return None
        if register is not None:
            self._pointer = register
        answer = self.read_bytes(length)
        self.stop()
        return answer

    def write(self, byte: int) -> bool:
        """Take the pointer, then register contents."""
        if self._expects_pointer:
            self._expects_pointer = False
            self._pointer = byte
        else:
            if self._is_hosts and self._is_reached():  # a message takes time on the wire
                self.advance(self._now())
            self._write_register(self._pointer, byte)
            self._pointer = NEXT[self._pointer]
        return True

    def read(self) -> int:
        """Give the register at the pointer; continuous modes lock data until ST2 is read."""
        register = self._pointer
        self._pointer = NEXT[register]
        if HXL <= register <= ST2:
            self._registers[ST1] = 0
            self._locked = register != ST2 and self._mode() in PERIODS
        elif ASAX <= register <= ASAZ and self._mode() != FUSE_ROM:
            self.warnings.note("ASA read outside fuse ROM mode; it is not valid there")
            return 0
        return self._registers[register]

    def read_bytes(self, length: int) -> bytes:
        """Give registers in a row; the last byte of a measurement, ST1 to ST2, unlocks it."""
        if self._pointer != ST1 or length != ST2 - ST1 + 1:
            return super().read_bytes(length)
        values = bytes(self._registers[ST1 : ST2 + 1])
        self._registers[ST1] = 0
        self._locked = False
        self._pointer = NEXT[ST2]
        return values

    def stop(self) -> None:
        """End the transaction."""
        self._in_transaction = False

    def _is_reached(self) -> bool:
        return self.host_reaches is None or self.host_reaches()

    def _open(self, *, read: bool) -> bool:
        if self._at < self._answers_from or self._registers[I2CDIS] == I2C_DISABLED:
            return False
        self._in_transaction = True
        self._expects_pointer = not read
        return True

    # Measuring

    def advance(self, at: int) -> None:
        """Bring the die to `at`: the last conversion that has ended by then lands."""
        self._at = at
        if at < self.lands_at:
            return
        period = PERIODS.get(self._registers[CNTL1] & 0x0F)
        if period is None:
            self._load(self.lands_at, skipped=False)
            self._enter(POWER_DOWN, self.lands_at)
        else:
            missed, since = divmod(at - self.lands_at, period)
            self.lands_at = at - since + period
            self._load(at - since, skipped=missed > 0)

    def _load(self, at: int, *, skipped: bool) -> None:
        """Put a sample into the data registers, unless they are locked: then it is lost."""
        if self._locked:
            self._registers[ST1] |= DOR
            return
        registers = self._registers
        overrun = skipped or registers[ST1] & DRDY
        fine = registers[CNTL1] & BITM
        field = self._measured(at)
        x, y, z = field
        overflow = abs(x) + abs(y) + abs(z) >= OVERFLOW_T
        registers[HXL:ST2] = DATA.pack(*self._counts(field, *(FINE if fine else COARSE)))
        registers[ST2] = fine | (HOFL if overflow else 0)
        registers[ST1] = DRDY | (DOR if overrun else 0)

    def _measured(self, at: int) -> Vector:
        """Return the field in T in the die's own axes, or the one of the self-test coil."""
        registers = self._registers
        if registers[ASTC] & SELF and registers[CNTL1] & 0x0F == SELF_TEST:
            return SELF_TEST_T
        x, y, z = self._field(at)
        if self._noise is not None:
            noise_x, noise_y, noise_z = self._noise.at(at)
            x, y, z = x + noise_x, y + noise_y, z + noise_z
        return y, x, -z

    def _counts(self, field: Vector, lsb: float, largest: int) -> list[int]:
        """Return what the converter gives, before the host adjusts it by ASA."""
        (x, y, z), (asa_x, asa_y, asa_z) = field, self._asa
        counts = [
            round(x * 256 / (asa_x + 128) / lsb),
            round(y * 256 / (asa_y + 128) / lsb),
            round(z * 256 / (asa_z + 128) / lsb),
        ]
        if max(counts) <= largest and min(counts) >= -largest:
            return counts
        return [max(-largest, min(largest, count)) for count in counts]

    # Registers

    def _mode(self) -> int:
        return self._registers[CNTL1] & 0x0F

    def _reset(self) -> None:
        self._registers[:] = bytes(256)
        self._registers[WIA], self._registers[INFO] = 0x48, 0x9A
        self._registers[ASAX : ASAZ + 1] = bytes(self._asa)
        self._locked = False
        self.lands_at = NEVER
        self._mode_allowed_at = self._at

    def _write_register(self, register: int, byte: int) -> None:
        if register == CNTL1:
            self._write_cntl1(byte & (BITM | 0x0F))
        elif register == CNTL2:
            if byte & SRST:
                self._reset()
        elif register in {ASTC, I2CDIS}:
            self._registers[register] = byte
        else:
            self.warnings.note(f"register 0x{register:02x} written; the real chip ignores it")

    def _write_cntl1(self, byte: int) -> None:
        """Set mode and width; a continuous mode restarts, another that runs goes on."""
        old, new = self._mode(), byte & 0x0F
        self._registers[CNTL1] = byte
        if new != old:
            self._warn_of_mode(old, new)
        if new != old or new in PERIODS:
            self._enter(new, self._at)

    def _warn_of_mode(self, old: int, new: int) -> None:
        if new not in MODES:
            self.warnings.note(f"mode {new} does not exist or is not modelled; nothing is measured")
        if POWER_DOWN not in {old, new}:
            self.warnings.note(
                f"mode changed from {old} to {new} without power-down; undefined on the real chip"
            )
        elif new != POWER_DOWN and self._at < self._mode_allowed_at:
            self.warnings.note(
                f"mode {new} set within 100 us of power-down; undefined on the real chip"
            )

    def _enter(self, mode: int, at: int) -> None:
        self._registers[CNTL1] = self._registers[CNTL1] & BITM | mode
        self._locked = False
        self.lands_at = at + CONVERSION if mode in MEASURING else NEVER
        self._mode_allowed_at = at + MODE_CHANGE_WAIT
