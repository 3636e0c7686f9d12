"""A fault of a bus, and what it does to a transaction: the base of `sim_doubles.faults`."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import Message
from sim_doubles.i2c_target import Target
from sim_doubles.i2c_wire import Transaction

_RANGES: Final = {
    **dict.fromkeys(("first", "since", "times", "index"), (0, NEVER)),
    **dict.fromkeys(("errno", "pulses"), (1, NEVER)),
    **dict.fromkeys(("register", "value", "byte"), (0, 0xFF)),
    "address": (0, 0x7F),
    "bit": (0, 7),
}
"""Range of each number of a fault, both ends included."""
_MAY_BE_NONE: Final = frozenset({"address", "last", "times"})


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


class Altering(Protocol):
    """A fault by which what is read is another than what the chip has put on the bus."""

    def alter(self, reading: Reading) -> bytes:
        """Return what is read instead."""


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
    altered: list["Altering"] = field(default_factory=list)
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


NO_REGISTER: Final = 256
"""In place of a register, of what a chip sends that is read without naming one."""


def burst_start(messages: Sequence[Message]) -> int:
    """Return the register a one-byte pointer write and a read begin at, else NO_REGISTER."""
    if len(messages) == 2 and isinstance(messages[1], int):
        pointer = messages[0]
        if isinstance(pointer, bytes) and len(pointer) == 1:
            return pointer[0]
    return NO_REGISTER


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

    def end(self, until: int) -> None:
        """Let it strike no more after an instant."""
        object.__setattr__(self, "until", until)

    @abstractmethod
    def strike(self, alteration: Alteration) -> None:
        """Enter what the fault does to the transaction."""
