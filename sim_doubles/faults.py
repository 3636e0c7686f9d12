"""Scripted faults of a bus: when each strikes, and how often.

A fault matches a transaction by address, by the transaction's number on its bus (0 is the first
since construction) and by the instant. `times` bounds how often it strikes; None is every time it
matches. Whatever struck is recorded, so a test can count it.

    FaultScript([NackAddress(address=0x68, first=10, times=3), StuckSda(since=5 * SECOND)])

A fault strikes within a transaction: a brown-out due while the bus is quiet happens at the start of
the next one. To cut the supply at an exact instant call the double's `power_cycle`.
"""

from abc import abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from firmware_runtime.hal.i2c import Message
from sim_doubles.i2c_target import Target
from sim_doubles.outputs import HasOutputs
from sim_doubles.scripted_fault import Alteration, Fault, Reading, burst_start

__all__ = [
    "AbsentTarget",
    "AdapterError",
    "AlteredAnswer",
    "BrokenOutput",
    "BrownOut",
    "ConstantAnswer",
    "Delay",
    "Fault",
    "FaultScript",
    "FlippedBit",
    "ForcedRegister",
    "FrozenAnswer",
    "Happening",
    "Injection",
    "NackAddress",
    "NackByte",
    "StuckSda",
]

KEPT = 1000


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


@dataclass(frozen=True, kw_only=True, eq=False)
class BrokenOutput(Fault):
    """One output of `target` is broken from the transaction on, until it is healed."""

    target: HasOutputs
    kind: str
    number: int

    def strike(self, alteration: Alteration) -> None:  # noqa: ARG002 -- the wires stay as they are
        """Break it."""
        self.target.break_output(self.kind, self.number)


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
