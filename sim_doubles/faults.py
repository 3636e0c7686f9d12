"""Scripted faults of a bus: when each strikes, and how often.

A fault matches a transaction by address, by the transaction's number on its bus (0 is the first
since construction) and by the instant. `times` bounds how often it strikes; None is every time it
matches. Whatever struck is recorded, so a test can count it.

    FaultScript([NackAddress(address=0x68, first=10, times=3), StuckSda(since=5 * SECOND)])

A fault strikes within a transaction: a brown-out due while the bus is quiet happens at the start of
the next one. To cut the supply at an exact instant call the double's `power_cycle`.
"""

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import Message
from sim_doubles.i2c_target import Target
from sim_doubles.i2c_wire import Transaction

KEPT = 1000
_RANGES: Final = {
    **dict.fromkeys(("first", "since", "times", "index"), (0, NEVER)),
    **dict.fromkeys(("errno", "pulses"), (1, NEVER)),
    **dict.fromkeys(("register", "value", "byte"), (0, 0xFF)),
    "address": (0, 0x7F),
    "bit": (0, 7),
}
"""Range of each number of a fault, both ends included."""
_MAY_BE_NONE: Final = frozenset({"address", "last", "times"})


@dataclass(slots=True)
class Alteration:
    """The sum of the faults due in one transaction; each of them enters its part.

    `pulses` is what a stuck bus needs to come free, `delay` ns pass before START, `forced` holds
    (register, value), `flipped` holds (index among the bytes read, mask).
    """

    errno: int | None = None
    pulses: int = 0
    address_refused: bool = False
    refused_byte: int | None = None
    browned_out: list[Target] = field(default_factory=list)
    absent: list[Target] = field(default_factory=list)
    forced: list[tuple[int, int]] = field(default_factory=list)
    flipped: list[tuple[int, int]] = field(default_factory=list)
    altered: list["AlteredAnswer"] = field(default_factory=list)
    delay: int = 0

    def cut(self, messages: tuple[Message, ...]) -> tuple[Message, ...]:
        """Return the messages up to the refused byte, without it."""
        if self.refused_byte is None:
            return messages
        left = self.refused_byte
        for index, message in enumerate(messages):
            if isinstance(message, bytes):
                if left < len(message):
                    return (*messages[:index], message[:left])
                left -= len(message)
        return messages

    def tampered(
        self,
        address: int,
        messages: tuple[Message, ...],
        answer: bytes,
        log: Sequence[Transaction],
    ) -> bytes:
        """Return the bytes read: altered, with forced values put in, bits flipped.

        `log` has the transactions that were before this one.
        """
        reading = Reading(address, messages, answer, log)
        for fault in self.altered:
            reading = reading._replace(answer=fault.alter(reading))
        altered = bytearray(reading.answer)
        for register, value in self.forced:
            altered[register - burst_start(messages)] = value
        for index, mask in self.flipped:
            altered[index] ^= mask
        return bytes(altered)


def burst_start(messages: Sequence[Message]) -> int:
    """Return the register a one-byte pointer write and a read begin at, 256 if it is not that."""
    if len(messages) == 2 and isinstance(messages[1], int):
        pointer = messages[0]
        if isinstance(pointer, bytes) and len(pointer) == 1:
            return pointer[0]
    return 256


@dataclass(frozen=True, kw_only=True, eq=False)
class Fault(ABC):
    """One fault and when it strikes: transactions `first` to `last`, instants `since` to `until`.

    All bounds are inclusive, instants are ns; None is no bound, and any address.
    """

    address: int | None = None
    first: int = 0
    last: int | None = None
    since: int = 0
    until: int = NEVER
    times: int | None = 1

    def __post_init__(self) -> None:
        """Raise SettingError for what no transaction could match."""
        for name in _RANGES.keys() & vars(self).keys():
            self._check(name, *_RANGES[name])
        self._check("last", self.first, NEVER)
        self._check("until", self.since, NEVER)
        target = getattr(self, "target", None)
        if not isinstance(target, Target | None):
            raise SettingError(f"target {target!r}", where=type(self).__name__, expected="a double")

    def _check(self, name: str, least: int, most: int) -> None:
        value = getattr(self, name)
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if value is None and name in _MAY_BE_NONE:
            return
        if not (is_whole and least <= value <= most):
            span = f"{least} or more" if most == NEVER else f"{least} to {most}"
            expected = f"expected a whole number, {span}"
            raise SettingError(f"{name} {value!r}; {expected}", where=type(self).__name__)

    def matches(self, number: int, at: int, address: int) -> bool:
        """Return whether this transaction is one to strike."""
        return (
            number >= self.first
            and (self.last is None or number <= self.last)
            and self.since <= at <= self.until
            and (self.address is None or address == self.address)
        )

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether these messages have what the fault is about; most faults fit any."""
        return len(messages) > 0

    @abstractmethod
    def strike(self, alteration: Alteration) -> None:
        """Enter what the fault does to the transaction."""


class NackAddress(Fault):
    """The address is not acknowledged; no target sees the START."""

    def strike(self, alteration: Alteration) -> None:
        """Enter the refusal."""
        alteration.address_refused = True


@dataclass(frozen=True, kw_only=True, eq=False)
class NackByte(Fault):
    """Written byte number `index` (0 is the first after the address) is refused and lost."""

    index: int

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether that many bytes are written."""
        return self.index < sum(len(m) for m in messages if isinstance(m, bytes))

    def strike(self, alteration: Alteration) -> None:
        """Enter the byte; of several the first ends the transaction."""
        already = alteration.refused_byte
        alteration.refused_byte = self.index if already is None else min(already, self.index)


@dataclass(frozen=True, kw_only=True, eq=False)
class AdapterError(Fault):
    """The adapter reports `errno` and puts nothing on the wire."""

    errno: int

    def strike(self, alteration: Alteration) -> None:
        """Enter the errno."""
        alteration.errno = self.errno


@dataclass(frozen=True, kw_only=True, eq=False)
class StuckSda(Fault):
    """SDA is held low from now on, until `pulses` recovery pulses or a power cycle of the bus."""

    pulses: int = 9

    def strike(self, alteration: Alteration) -> None:
        """Enter the pulses it takes."""
        alteration.pulses = self.pulses


@dataclass(frozen=True, kw_only=True, eq=False)
class FlippedBit(Fault):
    """Bit `bit` of read byte number `index` arrives inverted."""

    index: int
    bit: int

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether that many bytes are read."""
        return self.index < sum(m for m in messages if isinstance(m, int))

    def strike(self, alteration: Alteration) -> None:
        """Enter the bit."""
        alteration.flipped.append((self.index, 1 << self.bit))


@dataclass(frozen=True, kw_only=True, eq=False)
class ForcedRegister(Fault):
    """Reading `register` gives `value`, also within a burst: a wrong identity, a dead sensor.

    Strikes a one-byte pointer write followed by a read, with the pointer counting up.
    """

    register: int
    value: int
    times: int | None = None

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether the register is among those read."""
        start, length = burst_start(messages), messages[-1]
        return isinstance(length, int) and 0 <= self.register - start < length

    def strike(self, alteration: Alteration) -> None:
        """Enter the register and its value."""
        alteration.forced.append((self.register, self.value))


@dataclass(frozen=True, kw_only=True, eq=False)
class BrownOut(Fault):
    """`target` loses its supply for a moment, just before the transaction."""

    target: Target

    def strike(self, alteration: Alteration) -> None:
        """Enter the target."""
        alteration.browned_out.append(self.target)


@dataclass(frozen=True, kw_only=True, eq=False)
class AbsentTarget(Fault):
    """`target` is off the bus: it sees nothing, other targets at its addresses still answer.

    An AK8963 does not answer the MPU-9250's own master either, from one transaction on the bus that
    the fault strikes to the first one that it does not.
    """

    target: Target
    times: int | None = None

    def strike(self, alteration: Alteration) -> None:
        """Enter the target."""
        alteration.absent.append(self.target)


@dataclass(frozen=True, kw_only=True, eq=False)
class Delay(Fault):
    """The transaction takes `span` ns longer, as if the chip held the clock low before the rest."""

    span: int
    times: int | None = None

    def strike(self, alteration: Alteration) -> None:
        """Enter the time."""
        alteration.delay += self.span


class Reading(NamedTuple):
    """What is read by a transaction; `log` has the transactions that were before it."""

    address: int
    messages: tuple[Message, ...]
    answer: bytes
    log: Sequence[Transaction]

    @property
    def asked(self) -> tuple[int, tuple[Message, ...]]:
        """What it was read by."""
        return self.address, self.messages

    @property
    def before(self) -> bytes | None:
        """What was last read by the same messages; None if that is not in the log."""
        answers = (
            each.answer
            for each in reversed(self.log)
            if each.error is None and (each.address, each.messages) == self.asked
        )
        return next(answers, None)


@dataclass(frozen=True, kw_only=True, eq=False)
class AlteredAnswer(Fault):
    """What is read is another than what the chip has put on the bus."""

    times: int | None = None

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether anything is read."""
        return any(isinstance(message, int) for message in messages)

    def strike(self, alteration: Alteration) -> None:
        """Enter itself."""
        alteration.altered.append(self)

    @abstractmethod
    def alter(self, reading: Reading) -> bytes:
        """Return what is read instead."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrozenAnswer(AlteredAnswer):
    """What is read stays as it was: the answer to the same messages before, while the chip goes on.

    Messages that were not among the last on the bus are answered once more, and stay so.
    """

    _kept: dict[tuple[int, tuple[Message, ...]], bytes] = field(default_factory=dict, init=False)

    def alter(self, reading: Reading) -> bytes:
        """Return what was read by these messages when it froze, or now for the first time."""
        if reading.asked not in self._kept:
            self._kept[reading.asked] = reading.before or reading.answer
        return self._kept[reading.asked]


@dataclass(frozen=True, kw_only=True, eq=False)
class ConstantAnswer(AlteredAnswer):
    """Every byte that is read is `byte`; what is written arrives."""

    byte: int

    def alter(self, reading: Reading) -> bytes:
        """Return as many of it."""
        return bytes([self.byte]) * len(reading.answer)


@dataclass(frozen=True, kw_only=True, eq=False)
class Happening(Fault):
    """Something happens at an instant, or with the first transaction after it; no bytes differ."""

    action: Callable[[], None]

    def strike(self, alteration: Alteration) -> None:  # noqa: ARG002 -- the wires stay as they are
        """Let it happen."""
        self.action()


class Injection(NamedTuple):
    """One strike: which fault, in which transaction, when, at which address."""

    fault: Fault
    number: int
    at: int
    address: int


class FaultScript:
    """The faults of one bus and those that struck; `record` keeps the last thousand strikes."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._faults: list[Fault] = []
        for fault in faults:
            self.add(fault)
        self._struck: Counter[Fault] = Counter()
        self.record: deque[Injection] = deque(maxlen=KEPT)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Return those in it, over or not."""
        return tuple(self._faults)

    def add(self, fault: Fault) -> None:
        """Let one more fault strike from now on. Raises TypeError for what is none."""
        if not isinstance(fault, Fault):
            raise TypeError(f"{fault!r}: expected a fault, such as NackAddress()")
        self._faults.append(fault)

    def remove(self, fault: Fault) -> None:
        """Let a fault strike no more; nothing happens if it is not in the script."""
        if fault in self._faults:
            self._faults.remove(fault)

    def count(self, fault: Fault | None = None) -> int:
        """Return how often this fault struck; all of them without an argument."""
        return self._struck.total() if fault is None else self._struck[fault]

    def alteration(
        self, number: int, at: int, address: int, messages: Sequence[Message]
    ) -> Alteration | None:
        """Let what is due strike a transaction; None when nothing is."""
        due = [
            fault
            for fault in self._faults
            if (fault.times is None or self._struck[fault] < fault.times)
            and fault.matches(number, at, address)
            and fault.fits(messages)
        ]
        if not due:
            return None
        alteration = Alteration()
        for fault in due:
            fault.strike(alteration)
            self._struck[fault] += 1
            self.record.append(Injection(fault, number, at, address))
        return alteration
