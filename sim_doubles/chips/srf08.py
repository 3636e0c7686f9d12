"""Double of the Devantech SRF08, an ultrasonic ranger on I2C. Source: Devantech's SRF08 page.

Modelled: ranging in inches, centimetres and microseconds, 17 echoes, the range register with the
time it takes (250 us for each of its R + 1 steps), silence while ranging, the ANN mode, gain and
light, general call, change of address, and what a power cycle takes: all but the address.

Not modelled: what the gain does to an echo (`max_gain` has it, the world may weaken its echoes),
echoes of the ping before (an interval that is too short is warned of), the LED. Assumed where the
page is silent: the ping is sent at STOP; results are rounded to the nearest unit; an echo nearer
than 3 cm is not seen; registers above 35 read 0xFF; a gain above 31 counts as 31.
"""

from collections.abc import Callable, Sequence

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND
from firmware_runtime.hal.i2c import GENERAL_CALL
from sim_doubles.chips.devantech import DevantechDouble
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Words

ADDRESSES = range(0x70, 0x80)

COMMAND = 0  # reads as the software revision
GAIN = 1  # reads as the light
RANGE = 2  # reads as the first echo's high byte
REGISTERS = 36

UNIT_M = (0.0254, 0.01, 172e-6)  # inch, cm, and the way out and back in 1 us at 344 m/s
RANGING = range(0x50, 0x56)
ANN = 0x53  # and above: slots instead of echoes
ECHOES = 17
SLOTS = 32
SLOT_M = 2048 * 172e-6

NEAREST_M = 0.03
RANGE_STEP_M = 0.043
RANGE_STEP = 250 * MICROSECOND  # out and back over one step
LEAST_INTERVAL = 65 * MILLISECOND
MOST_GAIN = 31
MOST_RANGE = 255
GAINS = (
    *(94, 97, 100, 103, 107, 110, 114, 118, 123, 128, 133, 139, 145, 152, 159, 168),
    *(177, 187, 199, 212, 227, 245, 265, 288, 317, 352, 395, 450, 524, 626, 777, 1025),
)


class Srf08Double(DevantechDouble):
    """An SRF08; `echoes` gives the distances of what reflects, in m, nearest first.

    It is called at the instant of each ping, in ns. World face: `light` (0 to 255) is taken with
    each ping; `pings` counts them; `ranging` is whether the chip is deaf now.
    """

    measured = (Words(2, 1, is_signed=False),)

    def __init__(
        self,
        now: Now,
        address: int = ADDRESSES[0],
        *,
        echoes: Callable[[int], Sequence[float]],
        light: int = 128,
        revision: int = 10,
    ) -> None:
        super().__init__(now, "SRF08", address, ADDRESSES)
        self.light = light
        self.pings = 0
        self._echoes = echoes
        self._revision = revision
        self._last_ping_at: int | None = None
        self._asked: int | None = None  # a ranging command that waits for STOP
        self._reset()

    # World face

    @property
    def ranging(self) -> bool:
        """Return whether the chip waits for echoes and answers nothing."""
        return self._now() < self._ready_at

    @property
    def max_gain(self) -> int:
        """The analogue gain the receiver reaches at most: 94 to 1025."""
        return GAINS[self._gain]

    @property
    def farthest_m(self) -> float:
        """The distance from which an echo still counts."""
        return (self._range + 1) * RANGE_STEP_M

    # Bus face

    def _listens_to(self, address: int, *, read: bool) -> bool:
        if address != self.address:
            return address == GENERAL_CALL and not read and not self.ranging
        if self.ranging and not read:  # to read is how one asks whether it still ranges
            self.warnings.note("written to while ranging; the real chip does not acknowledge")
        return not self.ranging

    def _end(self) -> None:
        if self._asked is not None:
            self._ping(self._asked)
            self._asked = None

    def _read_register(self, register: int) -> int:
        return self._results[register] if register < REGISTERS else 0xFF

    def _write_register(self, register: int, byte: int) -> None:
        if register == COMMAND:
            self._take_command(byte)
            return
        self._break_off()
        if register == GAIN:
            if byte > MOST_GAIN:
                self.warnings.note(f"gain {byte} written; {MOST_GAIN} is the most there is")
            self._gain = min(byte, MOST_GAIN)
        elif register == RANGE:
            self._range = byte
        else:
            self.warnings.note(f"register 0x{register:02x} is read-only; the write is ignored")

    # Commands

    def _reset(self) -> None:
        """Take the power-up values: gain 31, range 255, no echoes."""
        super()._reset()
        self._gain, self._range = MOST_GAIN, MOST_RANGE
        self._ready_at = self._at
        self._asked = None
        self._results = bytes([self._revision, *bytes(REGISTERS - 1)])

    def _obey(self, command: int) -> bool:
        if command not in RANGING:
            return False
        self._asked = command
        return True

    # Ranging

    def _ping(self, command: int) -> None:
        self._warn_of_interval()
        self.pings += 1
        self._last_ping_at = self._at
        self._ready_at = self._at + (self._range + 1) * RANGE_STEP
        seen = [m for m in self._echoes(self._at) if NEAREST_M <= m <= self.farthest_m]
        counts = [round(m / UNIT_M[(command - RANGING[0]) % 3]) for m in seen[:ECHOES]]
        echoes = b"".join(count.to_bytes(2, "big") for count in counts)
        if command >= ANN:
            echoes = echoes[:2].ljust(2, b"\0") + _slots(seen)
        head = bytes([self._revision, self.light])
        self._results = (head + echoes).ljust(REGISTERS, b"\0")

    def _warn_of_interval(self) -> None:
        last = self._last_ping_at
        if last is not None and self._at - last < LEAST_INTERVAL:
            self.warnings.note(
                f"ranging {(self._at - last) / MILLISECOND:g} ms after the last; under 65 ms the "
                "real chip may receive the echoes of the ping before"
            )


def _slots(seen: Sequence[float]) -> bytes:
    """Return ANN mode's 32 bytes: 1 where an echo came within that slot of 2048 us."""
    filled = {int(m / SLOT_M) for m in seen}
    return bytes(slot in filled for slot in range(SLOTS))
