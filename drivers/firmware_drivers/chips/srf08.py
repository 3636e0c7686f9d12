"""Devantech SRF08 ultrasonic ranger on I2C (Devantech, SRF08 technical specification page).

The driver starts one ranging at a time, in centimetres, and reads its first echo once the chip
answers again: while it ranges it acknowledges nothing. How long that takes follows from the range
register; the driver knows it (`ranging_ns`) and never waits.

Range and gain are forgotten with the supply and cannot be read back, so they are sent with every
ranging: a sonar that lost power is as set again with the next one. A short range wants a low gain,
or a late echo of the ping before is taken for a target.

A wall that stands still is distinguished from a sonar that does by ranging in another unit: after
`SAME_BEFORE_PROOF` equal echoes one ranging is in microseconds, and a chip that ranges answers 58
times as much. One that answers the same is stuck. An echo where there was none is proved by the
very next ranging: it may be a bit that is wrong. No echo is 0 in every unit: whether its
transducers still work cannot be known.

The chip has no identity, and many parts have a byte at 0 that could be its revision. So a bring-up
ranges once, to the farthest: an SRF08 is silent meanwhile, and reads its revision and an echo then,
where a memory reads the command and the range that were written.

Not used: further echoes, light sensor, ANN mode, broadcast ranging, change of address. A ranging
that another program started looks like one of ours, and a chip that lost its supply while it ranged
looks like one that received no echo.
"""

import math
import struct
from dataclasses import dataclass
from typing import Final

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, Stuck

ADDRESSES: Final = range(0x70, 0x80)
SHIPPED_AT: Final = 0x70
"""Every PCA9685 answers there too until its ALLCALL is off: beside one, give it another address."""

COMMAND: Final = 0x00
REVISION: Final = 0x00
GAIN: Final = 0x01
RANGE: Final = 0x02
RANGE_IN_CENTIMETRES: Final = 0x51
RANGE_IN_MICROSECONDS: Final = 0x52
SAME_BEFORE_PROOF: Final = 16

RANGE_STEP_M: Final = 0.043
RANGE_STEP_NS: Final = 250_000
"""One step of the range register: 43 mm there and back at the chip's 344 m/s."""
RANGE_STEPS: Final = 256
FARTHEST: Final = RANGE_STEPS - 1
LONGEST_RANGE_M: Final = RANGE_STEPS * RANGE_STEP_M
NEAREST_M: Final = 0.03
MARGIN_NS: Final = 1_000_000
LONGEST_RANGING_NS: Final = RANGE_STEPS * RANGE_STEP_NS + MARGIN_NS
MEASURED_AFTER_NS: Final = 80_000_000
"""The same with room for a chip that is slower than it says."""
SILENT_AFTER_NS: Final = 10_000_000
"""Into a ranging; a memory has stored what was written by then, and answers again."""
INTERVAL_NS: Final = 65_000_000
"""Shortest time from ping to ping, whatever the range: older echoes have died away by then."""

FIRST_ECHO: Final = struct.Struct(">BxH")
"""Software revision, light sensor, first echo in cm: registers 0 to 3."""
MOST_CM: Final = 1101
"""The longest range, rounded up; more cannot be an echo."""
MICROSECONDS_PER_CM: Final = 1e-2 / 172e-6
"""There and back at the chip's 344 m/s."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    *((bytes(2),) for _ in range(3)),
    (bytes((REVISION,)), FIRST_ECHO.size),
)
"""Transactions of one ranging, start and reading, for the bus-time budget."""
NO_REVISION: Final = (0x00, 0xFF)
"""Values read when SDA is held, or no chip drives it: the sign of a chip still ranging."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Srf08Settings:
    """Range and gain; either may be wrong until `faults` was checked."""

    max_range_m: float = 3.0
    """Echoes from farther away are not waited for; rounded up to whole 43 mm."""
    gain: int = 31
    """Greatest analogue gain, which rises with time after a ping: 0 (94) to 31 (1025)."""

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        faults = []
        if not 0 < self.max_range_m <= LONGEST_RANGE_M:
            faults.append(f"max_range_m: {self.max_range_m}, expected more than 0, 11.008 at most")
        if not 0 <= self.gain <= 31:
            faults.append(f"gain: {self.gain}, expected 0 to 31")
        return tuple(faults)

    def range_register(self) -> int:
        """Give the least register value that reaches `max_range_m`."""
        return math.ceil(round(self.max_range_m / RANGE_STEP_M, 6)) - 1


class Srf08(I2cChip):
    """One SRF08: `ranging_ns` after `start_ranging` its first echo can be read, once.

    `interval_ns` is the shortest time from one start to the next, `limits_m` the nearest and the
    farthest it measures: what is nearer than `nearest_m` is never said.
    """

    chip = "SRF08"
    addresses = ADDRESSES
    nearest_m = NEAREST_M

    def __init__(
        self, bus: I2cBus, address: int = SHIPPED_AT, settings: Srf08Settings | None = None
    ) -> None:
        settings = settings or Srf08Settings()
        super().__init__(bus, address, settings.faults())
        self.ranging_ns = (1 + settings.range_register()) * RANGE_STEP_NS + MARGIN_NS
        self.interval_ns = INTERVAL_NS
        self.limits_m = (NEAREST_M, (1 + settings.range_register()) * RANGE_STEP_M)
        self._gain, self._range = settings.gain, settings.range_register()
        farthest_m = self.limits_m[1] + RANGE_STEP_M  # no sonar counts its steps so exactly
        self._most_cm = math.ceil(farthest_m * 100)
        self._revision = 0
        self._is_ranging = False
        self._echo = 0
        self._same = 0
        """Echoes in a row that were equal to the last bit, in whatever unit."""
        self._is_proof_due = False

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready, 145 ms: a former program's ranging ends first.

        The steps raise NoAcknowledge or WrongDevice.
        """
        return (
            Step("let a former ranging end", lambda: None, LONGEST_RANGING_NS),
            Step("range to the farthest", self._range_to_the_farthest, SILENT_AFTER_NS),
            Step("find it silent", self._find_it_silent, MEASURED_AFTER_NS - SILENT_AFTER_NS),
            Step("find what it measured", self._find_what_it_measured, 0),
        )

    def identify(self) -> None:
        """Check that the software revision can be one; the chip has no identity register.

        Raises NoAcknowledge if nothing answers, WrongDevice for a revision of 00 or ff.
        """
        self._read_revision()

    def start_ranging(self) -> None:
        """Set gain and range and send one ping; not before the last ranging ended.

        Three transactions of 3 bytes, 0.22 ms at 400 kHz.
        Raises NoAcknowledge if the chip is absent or still ranges.
        """
        self._is_ranging = False
        self._send(self._range, self._unit())
        self._is_ranging = True

    def read_distance(self) -> float:
        """Read the first echo of the ranging that was started, in m to 1 cm; +inf if none came.

        One burst of 7 bytes, 0.17 ms at 400 kHz. Not before `ranging_ns` have passed.
        Raises NotReady if no ranging was started or the chip does not answer yet, and when it is
        gone it never does; NotReady too if the bytes cannot be an echo. Stuck if they stay the same
        in another unit.
        """
        if not self._is_ranging:
            raise self._not_ready("no ranging to read", "one started and not read")
        try:
            found = self._read(REVISION, FIRST_ECHO.size)
        except NoAcknowledge as error:
            raise self._not_ready(
                f"no answer, expected the echo {self.ranging_ns / 1e6:g} ms after the "
                "ping; it still ranges, or is gone"
            ) from error
        revision, echo = FIRST_ECHO.unpack(found)
        in_proof = self._is_proof_due
        centimetres = round(echo / MICROSECONDS_PER_CM) if in_proof else echo
        if revision in NO_REVISION or centimetres > self._most_cm:
            raise self._not_ready(
                f"registers 0 to 3 read {found.hex(' ')}",
                f"a revision from 01 to fe and an echo of {self._most_cm} cm at most, its range",
            )
        self._is_ranging = False
        is_new = self._echo == 0
        self._same = self._same + 1 if echo == self._echo else 0
        self._echo = echo
        if in_proof and echo and self._same:
            raise Stuck(self.place, "echo", echo, self._same + 1)
        if in_proof:
            self._same, self._echo = 0, centimetres
        stands = is_new or self._same >= SAME_BEFORE_PROOF
        self._is_proof_due = not in_proof and echo > 0 and stands
        return centimetres / 100 if centimetres else math.inf

    def _send(self, range_register: int, unit: int) -> None:
        settings = ((GAIN, self._gain), (RANGE, range_register), (COMMAND, unit))
        with self._must_answer("the chip there and idle", "no answer to a ranging command"):
            for register, value in settings:
                self._write(register, value)

    # What only a sonar does ---------------------------------------------------------------------

    def _read_revision(self) -> int:
        with self._must_answer("a software revision"):
            revision = self._read(REVISION)[0]
        if revision in NO_REVISION:
            raise self._wrong_device(
                f"software revision reads {revision:02x}, expected 01 to fe; another "
                "device answers here, or a line is held"
            )
        return revision

    def _range_to_the_farthest(self) -> None:
        self._is_ranging = False
        self._revision = self._read_revision()
        self._send(FARTHEST, RANGE_IN_CENTIMETRES)

    def _find_it_silent(self) -> None:
        if self._bus.acknowledges(self.address):
            raise self._wrong_device(
                f"not an SRF08: it answers {SILENT_AFTER_NS / 1e6:g} ms after a ranging command",
                f"silence for {RANGE_STEPS * RANGE_STEP_NS / 1e6:g} ms",
            )

    def _find_what_it_measured(self) -> None:
        what = f"no answer {MEASURED_AFTER_NS / 1e6:g} ms after a ranging command"
        with self._must_answer("an echo", what):
            found = self._read(REVISION, FIRST_ECHO.size)
        revision, echo = FIRST_ECHO.unpack(found)
        if revision != self._revision or echo > MOST_CM:
            raise self._wrong_device(
                f"not an SRF08: registers 0 to 3 read {found.hex(' ')} after a ranging",
                f"revision {self._revision:02x} as before and an echo of {MOST_CM} cm at most",
            )

    def _unit(self) -> int:
        """The command of a ranging: in centimetres, unless an echo is new or stands still."""
        return RANGE_IN_MICROSECONDS if self._is_proof_due else RANGE_IN_CENTIMETRES
