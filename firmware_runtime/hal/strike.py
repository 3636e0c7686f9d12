"""Faults of doubles by kind: what can be broken on a robot without hardware, in one vocabulary.

A script of faults is a list of entries, the same everywhere: in `open_board(faults=...)`, in
`run --fault`, in `doubles fault`, and on the socket of served doubles.

    Strike("freeze", "imu", at_s=2.0, for_s=1.0)

A bus or port of doubles that can be broken is `Breakable`; `board.struck_doubles` finds the lines
by the names of a board.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Final, Literal, NamedTuple, Protocol, TypeAlias, runtime_checkable

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.devs.time import LONGEST_S, NEVER, seconds
from firmware_runtime.errors import expected_one_of

Of: TypeAlias = Literal["I2C", "sensor", "serial", "chip", "actuator", "machine", "people", "world"]
"""Things that a kind can be about: an I2C bus or a chip on it, what a chip on it measures, a serial
port, a chip, what a chip drives, the robot's computer, who commands it, the world."""
OF_NO_DEVICE: Final = frozenset({"machine", "people", "world"})
"""Those that have no device by a name."""

LEAST_AGAIN: Final = 3
"""So often a fault comes, at least, that comes again and again: two are a pair."""
HOLD_UP_A_LINE: Final = ("stuck", "arbitration", "fault", "slow")
"""Kinds that keep all of a bus from going on, whichever of its chips they are made at."""

Needs: TypeAlias = Literal["", "read", "write"]
"""What a transaction must have for a kind to show in it: any will do, one that reads, or writes."""


class Kind(Struct, array_like=True, frozen=True):
    """One kind of fault."""

    name: str
    meaning: str
    of: Of
    is_moment: bool = False
    """Whether it happens at an instant, and takes no span of time."""
    amount: float | None = None
    """How much of it there is unless stated; None for a kind that has no amount."""
    unit: str = ""
    needs: Needs = ""
    """What a transaction must have for it to show."""
    fails: bool = False
    """Whether each transaction that it strikes ends in an error, as its driver sees it."""
    is_numbered: bool = False
    """Whether its amount is the number of a bit, a byte or a measured word, counted round."""

    @property
    def leaves_no_doubt(self) -> bool:
        """Return whether what it strikes has failed, and tells no lie."""
        return self.fails or self.of == "chip"

    @property
    def can_be_once(self) -> bool:
        """Return whether it can strike a single transaction."""
        return self.of in {"I2C", "sensor"}


def _of_axis(name: str, meaning: str) -> Kind:
    unit = "number of the word"
    return Kind(name, meaning, "sensor", amount=0.0, unit=unit, needs="read", is_numbered=True)


def _of_output(name: str, meaning: str) -> Kind:
    unit = "number of the output"
    return Kind(name, meaning, "actuator", amount=0.0, unit=unit, needs="write", is_numbered=True)


_ALL: Final = (
    Kind("nack", "the address is not acknowledged", "I2C", fails=True),
    Kind(
        "nack-data",
        "the first byte that is written is not acknowledged",
        "I2C",
        needs="write",
        fails=True,
    ),
    Kind("stuck", "a line is held low: every transaction times out", "I2C", fails=True),
    Kind("arbitration", "another controller wins the bus", "I2C", fails=True),
    Kind("fault", "the adapter reports an error of its own", "I2C", fails=True),
    Kind("freeze", "every reading is the last one again", "I2C", needs="read"),
    Kind("zero", "every byte read is 0x00", "I2C", needs="read"),
    Kind("ones", "every byte read is 0xff, as of a line that is pulled up", "I2C", needs="read"),
    Kind("late", "every reading is the one before", "I2C", needs="read"),
    Kind(
        "flip",
        "one bit of what is read arrives inverted",
        "I2C",
        amount=0.0,
        unit="number of the bit",
        needs="read",
        is_numbered=True,
    ),
    Kind(
        "wrong-byte",
        "one byte of what is read arrives with all its bits inverted",
        "I2C",
        amount=0.0,
        unit="number of the byte",
        needs="read",
        is_numbered=True,
    ),
    Kind(
        "slow",
        "each transaction takes so much longer: a chip stretches the clock",
        "I2C",
        amount=0.5,
        unit="ms",
    ),
    _of_axis("freeze-axis", "one measured word stays as it was"),
    _of_axis(
        "offset", "one measured word is 2000 counts more; with a sign, counted round once, less"
    ),
    _of_axis("scale", "one measured word is twice as much"),
    _of_axis("negate", "one measured word has the other sign"),
    _of_axis("full-scale", "one measured word is at the end of its scale"),
    _of_axis("noise", "one measured word changes ten times as much from reading to reading"),
    _of_axis("swap", "one measured word and the next one are exchanged"),
    Kind("silent", "the wires are parted: no byte arrives, either way", "serial", fails=True),
    Kind("drop", "the next byte on the line is lost", "serial", is_moment=True),
    Kind("garble", "the next byte on the line arrives inverted", "serial", is_moment=True),
    Kind("brown-out", "the supply fails for a moment: power-up state", "chip", is_moment=True),
    Kind("absent", "no supply: off and silent; then power-up state", "chip", fails=True),
    _of_output("ignored", "one output stays as it was, whatever its chip is told"),
    _of_output("weak", "one output acts with half of what its chip is told"),
    _of_output("dead", "one output does nothing"),
    _of_output("full-on", "one output acts with all it has"),
    Kind(
        "stall",
        "the process gets no processor time for so long",
        "machine",
        is_moment=True,
        amount=50.0,
        unit="ms",
    ),
    Kind("disarm", "its operator disarms it; then it is armed again", "people"),
    Kind("reload", "its settings are taken up again, unchanged", "people", is_moment=True),
    Kind("push", "the robot is pushed", "world", is_moment=True, amount=1.0),
    Kind("hold", "something holds the robot: it does not move, whatever drives it", "world"),
)
KINDS: Final[Mapping[str, Kind]] = {kind.name: kind for kind in _ALL}


class Strike(Struct, tag="strike", array_like=True, frozen=True):
    """One fault of doubles: its kind, what it strikes, when, and for how long.

    `device` is a device, bus or port by its name in board.toml, or a chip as `0x68` or `i2c1@0x68`;
    empty is all that the kind fits. `at_s` counts from the start of the run, or from now for
    doubles that are served. `for_s` None is until it is cleared, 0 is once; `amount` None is the
    kind's own.
    """

    kind: str
    device: str = ""
    at_s: float = 0.0
    for_s: float | None = None
    amount: float | None = None

    @property
    def span(self) -> int:
        """Ns that it lasts, at most; NEVER for one without an end, 0 for one that strikes once."""
        if KINDS[self.kind].is_moment:
            return 0
        return NEVER if self.for_s is None else seconds(self.for_s)

    @property
    def extent(self) -> float | None:
        """How much of it there is, as stated or by its kind; None of what has no amount."""
        return KINDS[self.kind].amount if self.amount is None else self.amount

    @property
    def at(self) -> int:
        """Ns from the start of the run, or from now."""
        return seconds(self.at_s)

    def again(self, times: int, every_s: float) -> "tuple[Strike, ...]":
        """Return it so many times, one every so many seconds."""
        return tuple(replace(self, at_s=self.at_s + count * every_s) for count in range(times))

    def fault(self) -> str | None:
        """Return a sentence about what cannot be in it; None where it is sound."""
        kind = KINDS.get(self.kind)
        if kind is None:
            return f"kind {self.kind!r}; {expected_one_of(self.kind, KINDS)}"
        if not _is_span(self.at_s):
            return f"{self.kind}: at {self.at_s!r} s; expected 0 or more"
        return _span_fault(kind, self.for_s) or _amount_fault(kind, self.amount)

    def __str__(self) -> str:
        amount = "" if self.amount is None else f" {self.amount:g}"
        return f"{self.kind}{amount}{self.device and ' of '}{self.device}"


def _span_fault(kind: Kind, for_s: float | None) -> str | None:
    if for_s is None:
        return None
    if not _is_span(for_s):
        return f"{kind.name}: for {for_s!r} s; expected 0 or more"
    if for_s > 0 and kind.is_moment:
        return f"{kind.name}: for {for_s:g} s; expected none, it is over at once"
    if for_s == 0 and not (kind.can_be_once or kind.is_moment):
        return f"{kind.name}: for 0 s, which is once; expected more than 0"
    return None


def _amount_fault(kind: Kind, amount: float | None) -> str | None:
    if amount is None:
        return None
    if kind.amount is None:
        return f"{kind.name}: amount {amount!r}; expected none, it has no amount"
    if not math.isfinite(amount):
        return f"{kind.name}: amount {amount!r}; expected a finite number"
    return None


def _is_span(value: float) -> bool:
    return 0 <= value <= LONGEST_S


def interval_of(strikes: Sequence[Strike]) -> float | None:
    """Return every how many seconds one fault comes again in a script; None for other scripts."""
    if len(strikes) < LEAST_AGAIN:
        return None
    first, second, *_ = strikes
    every_s = round(second.at_s - first.at_s, 9)
    return every_s if tuple(strikes) == first.again(len(strikes), every_s) else None


class Place(Struct, array_like=True, frozen=True):
    """Something that can be struck by name: a device, or a line with all that is on it."""

    name: str
    chip: str
    """Its chip; empty for a line."""
    line: str
    """Bus or port that it is on."""
    address: int | None
    """Its address; None on a serial port, and for a line."""
    kinds: tuple[str, ...]
    """Kinds of faults that fit."""
    is_line: bool = False

    @property
    def what(self) -> str:
        """Return what it is, in a few words."""
        if self.is_line:
            return "line"
        return self.chip if self.address is None else f"{self.chip} at 0x{self.address:02x}"


class Struck(Struct, array_like=True, frozen=True):
    """A fault that was made: `at` ns of the doubles' time, for `span` ns; None has no end yet."""

    kind: str
    device: str
    at: int
    span: int | None
    amount: float | None


class Use(NamedTuple):
    """One use of a line by its driver: `at` ns, of which chip, and what went over it."""

    at: int
    address: int | None
    """None on a serial port."""
    reads: bool
    writes: bool

    def shows(self, kind: Kind) -> bool:
        """Return whether a fault of a kind would show in it."""
        return not kind.needs or (self.reads if kind.needs == "read" else self.writes)


class Span(NamedTuple):
    """Instants from `since` to `until`, both included, ns; `once`: the first time only."""

    since: int
    until: int
    once: bool


@runtime_checkable
class Breakable(Protocol):
    """A line of doubles on which faults can be made: an I2C bus or a serial port."""

    @property
    def addresses(self) -> Collection[int]:
        """Addresses of its chips, as far as these say; none on a serial port."""

    @property
    def struck_at(self) -> int | None:
        """The instant at which a fault made by `strike` first showed on it, ns; None before."""

    def uses(self) -> Iterator[Use]:
        """Yield the last uses of it, the newest first; how many is up to the line."""

    def fitting(self, address: int | None) -> Collection[str]:
        """Return the kinds that fit the chip with this address; None is any on the line."""

    def strike(self, kind: str, address: int | None, span: Span, amount: float) -> None:
        """Make one, at the chip with this address, or at all of the line; `amount` is of it."""

    def call_at(self, at: int, action: Callable[[], None]) -> None:
        """Call at `at`, or when the line is next used after it."""

    def end_strikes(self, at: int) -> None:
        """Let every fault that has no end be over after `at`, as if it had been made so."""

    def clear_strikes(self) -> None:
        """End every fault that `strike` has made; what had no supply is in its power-up state."""
