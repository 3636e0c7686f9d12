"""Recorded lines: a bus and a port that answer in the recorded order, bytes or errors.

    what is due is asked            it is answered, and the next is due
    what switches off (`stops`)      answered; what is due stays due
    anything else, strict           refused (EPROTO); what is due stays due
    anything else, not strict       answered by the next recorded one of that device and shape

Nothing takes time: an answer comes at once.
"""

import errno
import os
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NoReturn

from firmware_runtime.hal.wire_errors import errno_of
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE, Transfer
from sim_doubles.recorded.stops import Stops, key_of
from sim_doubles.recorded.traffic import Deviation, Deviations, Recorded

REFUSAL: Final = errno.EPROTO
"""Errno of a refused transaction; no adapter of ours reports it."""


@dataclass(frozen=True, slots=True)
class Rules:
    """Rules for a transaction that is not the recorded one."""

    is_strict: bool
    stops: Stops
    deviations: Deviations


class RecordedLine:
    """Traffic of one line; `last_at` is the instant of the run that it has come to, ns."""

    def __init__(self, name: str, recorded: Sequence[Recorded], rules: Rules) -> None:
        self.last_at = 0
        self._name = name
        self._recorded = recorded
        self._rules = rules
        self._place = 0

    @property
    def due(self) -> Recorded | None:
        """Return the next recorded transaction; None at the end."""
        return self._recorded[self._place] if self._place < len(self._recorded) else None

    def _go_past(self, recorded: Recorded) -> None:
        self._place = max(self._place, recorded.place + 1)
        self.last_at = recorded.transfer.at

    def _stopped(
        self, due: Recorded | None, address: int, messages: Sequence[bytes | int] | bytes
    ) -> bytes | None:
        """The answer to what switches off; None if this does not."""
        answer = self._rules.stops.get(key_of(self._name, address, messages))
        if answer is not None:
            self._deviates(due, address, messages, "answered, as it switches off")
        return answer

    def _deviates(
        self, due: Recorded | None, address: int, messages: object, done: str = "refused"
    ) -> None:
        deviation = Deviation(self._name, due, address, messages, done)
        self._rules.deviations.add(deviation)

    def _refuse(self, due: Recorded | None, address: int, messages: object) -> NoReturn:
        self._deviates(due, address, messages)
        raise OSError(REFUSAL, os.strerror(REFUSAL))


class RecordedBus(RecordedLine):
    """An I2C bus."""

    def __init__(self, name: str, recorded: Sequence[Recorded], rules: Rules) -> None:
        super().__init__(name, recorded, rules)
        self._by_shape: dict[object, deque[Recorded]] = {}
        for each in recorded:
            shape = _shape(each.transfer.address, each.transfer.messages)
            self._by_shape.setdefault(shape, deque()).append(each)

    @property
    def is_over(self) -> bool:
        """Return whether nothing is left to ask for."""
        return self.due is None

    def transfer(self, address: int, messages: Sequence[bytes | int]) -> bytes:
        """Answer a transaction. Raises the OSError that the adapter reported, or a refusal."""
        messages = list(messages)
        due = self.due
        if due is not None and due.asks(address, messages):
            alike = self._by_shape[_shape(address, messages)]
            while alike and alike[0].number <= due.number:  # those passed over, and itself
                alike.popleft()
            return self._answered(due)
        if (stopped := self._stopped(due, address, messages)) is not None:
            return stopped
        found = None if self._rules.is_strict else self._next_like(address, messages)
        if found is None:
            self._refuse(due, address, messages)
        self._deviates(due, address, messages, f"answered by transaction {found.number}")
        return self._answered(found)

    def _answered(self, recorded: Recorded) -> bytes:
        self._go_past(recorded)
        return _answer(recorded.transfer)

    def _next_like(self, address: int, messages: Sequence[bytes | int]) -> Recorded | None:
        alike = self._by_shape.get(_shape(address, messages))
        return alike.popleft() if alike else None


class RecordedPort(RecordedLine):
    """A serial port.

    A read finds what the recorded one found there, in its place between the writes, and nothing
    where none was recorded: programs poll a port by time, so reads are not compared. Bytes that
    were not read before a write stay readable after it.
    """

    def __init__(self, name: str, recorded: Sequence[Recorded], rules: Rules) -> None:
        super().__init__(name, recorded, rules)
        self._arrived = b""
        self._last_place = max(
            (each.place for each in recorded if _counts(each.transfer)), default=-1
        )

    @property
    def is_over(self) -> bool:
        """Return whether nothing is left to be written or read."""
        return self._place > self._last_place

    def read(self) -> bytes:
        """Take what had arrived. Raises the OSError that the port reported."""
        due = self.due
        if due is not None and due.transfer.address != WRITE:
            self._go_past(due)
            self._arrive(due.transfer)
            if due.transfer.address == DISCARD:
                return b""
        arrived, self._arrived = self._arrived, b""
        return arrived

    def write(self, data: bytes) -> None:
        """Compare what is written. Raises the OSError that the port reported, or a refusal."""
        due = self._next_write()
        if due is None or not due.asks(WRITE, data):
            if self._stopped(due, WRITE, data) is not None:
                return
            if due is None or self._rules.is_strict:
                self._refuse(due, WRITE, data)
            self._deviates(due, WRITE, data, f"taken for transaction {due.number}")
        for each in self._recorded[self._place : due.place]:
            if not each.transfer.failed:
                self._arrive(each.transfer)
        self._go_past(due)
        _answer(due.transfer)

    def _next_write(self) -> Recorded | None:
        left = map(self._recorded.__getitem__, range(self._place, len(self._recorded)))
        return next((each for each in left if each.transfer.address == WRITE), None)

    def _arrive(self, transfer: Transfer) -> None:
        if transfer.address == READ:
            self._arrived += _answer(transfer)
        else:
            _answer(transfer)
            self._arrived = b""


def _shape(address: int, messages: Sequence[bytes | int]) -> object:
    """Return the address, the lengths written and read, and their order."""
    return address, tuple(each if isinstance(each, int) else -len(each) for each in messages)


def _counts(transfer: Transfer) -> bool:
    """Return whether a use of a port is more than a look at nothing."""
    return transfer.address == WRITE or bool(transfer.answer)


def _answer(recorded: Transfer) -> bytes:
    """Return the bytes read. Raises the OSError that was reported."""
    if recorded.failed:
        number = errno_of(*recorded.answer)
        raise OSError(number, os.strerror(number))
    answer: bytes = recorded.answer
    return answer
