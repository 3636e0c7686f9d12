"""The feed: gives a replay what the run was given, in the order in which it is asked for.

What is asked for beyond what was recorded, or otherwise than it was, is a difference. A replay of
other code or settings goes on all the same: a read is answered by the next of that device, a write
is taken.
"""

from collections.abc import Callable, Container, Iterator
from typing import Any, Final, TypeAlias

import msgspec

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import Kind, Section, Transfer, sent_of
from firmware_runtime.recording.replay.difference import NOTHING, Difference

Report: TypeAlias = Callable[[Difference], None]


class Feed:
    """Feed of one section after the other; `report` gets the differences."""

    def __init__(self, header: Header, report: Report) -> None:
        self.lines = header.lines
        self.is_virtual = header.clock == VirtualClock.__name__
        self._report = report
        self._at = 0
        self._last_reading = 0
        self.load(Section(Kind.BUILD, 0, [], [], [], [], msgspec.Raw(b"\x90"), [], []))

    def load(self, section: Section) -> None:
        """Give what this section holds from now on."""
        self._at = section.at
        self._section = section
        self._readings = iter(section.readings)
        self._still_at = next(self._readings, section.at) if self.is_virtual else section.at
        self._times = iter(section.times)
        self._enabled = iter(section.enabled)
        self._world = iter(section.world)
        self._transfers = list(reversed(section.transfers))
        self._sent: list[tuple[int, object]] | None = None
        self._was_enabled = False
        self._asked_too_much = False

    def check_all_taken(self) -> None:
        """Report what the section holds and was not asked for."""
        for transfer in reversed(self._transfers):
            self._differs("write", *self._named(transfer), transfer.messages, NOTHING)
        for name, left in (
            ("clock", self._readings),
            ("line time", self._times),
            ("interlock", self._enabled),
        ):
            if not self._asked_too_much and (count := sum(1 for _ in left)):
                self._differs("asked", "", name, f"{count} more answers", NOTHING)

    def reading(self) -> int:
        """Return the clock's next reading; in virtual time it stands still within a section."""
        if self.is_virtual:
            return self._still_at
        self._last_reading = self._next(self._readings, "clock", self._last_reading)
        return self._last_reading

    def time(self) -> int:
        """Return the next time of the lines."""
        time: int = self._next(self._times, "line time", 0)
        return time

    def elapsed(self) -> int:
        """Return how far the lines had run ahead of the step."""
        return self.time()

    def enabled(self) -> bool:
        """Return whether outputs were enabled."""
        self._was_enabled = self._next(self._enabled, "interlock", self._was_enabled)
        return self._was_enabled

    def world(self, otherwise: int) -> int:
        """Return the next answer of a model of the world; `otherwise` if there is no more."""
        said: int = self._next(self._world, "world", otherwise)
        return said

    def world_sent(self, place: int, numbers: Container[int]) -> Any:  # noqa: ANN401 -- a form
        """Return what the world sent by a port of these, as number and form; None if it did not.

        `place` is how much has been sent in this section so far.
        """
        recorded = self.sent()
        if place < len(recorded) and recorded[place][0] in numbers:
            return recorded[place]
        return None

    def sent(self) -> list[tuple[int, object]]:
        """All that was sent in the section."""
        if self._sent is None:
            self._sent = sent_of(self._section)
        return self._sent

    def transfer(self, line: int, address: int, messages: object) -> Transfer | None:
        """Return the recorded transfer like this one; None if there was none."""
        place = self._place(line, address, messages)
        asked = Transfer(line, address, messages, b"", self._at)
        if place is None:
            self._differs("write", *self._named(asked), NOTHING, asked.messages)
            return None
        recorded = self._transfers.pop(place)
        if place != len(self._transfers):  # others were recorded before it
            missed = self._transfers[-1]
            self._differs("write", *self._named(missed), missed.messages, asked.messages)
        elif recorded.messages != messages:
            self._differs("write", *self._named(asked), recorded.messages, asked.messages)
        return recorded

    def _place(self, line: int, address: int, messages: object) -> int | None:
        """Find the next transfer of this shape, counted from the end of the section."""
        shape = shape_of(messages)
        for place in range(len(self._transfers) - 1, -1, -1):
            each = self._transfers[place]
            if (each.line, each.address) == (line, address) and shape_of(each.messages) == shape:
                return place
        return None

    def _next(self, answers: Iterator[object], name: str, otherwise: Any) -> Any:  # noqa: ANN401
        answer = next(answers, None)
        if answer is not None:
            return answer
        if not self._asked_too_much:
            self._asked_too_much = True
            self._differs("asked", "", name, NOTHING, "one more answer")
        return otherwise

    def _named(self, transfer: Transfer) -> tuple[str, str]:
        return self.device(transfer.line, transfer.address), "transfer"

    def device(self, line: int, address: int) -> str:
        """The name of a device, also on a line that the recording does not name."""
        is_named = 0 <= line < len(self.lines)
        return device_name(self.lines[line] if is_named else f"line {line}", address)

    def _differs(
        self, what: str, model: str, field: str, recorded: object, replayed: object
    ) -> None:
        self._report(Difference(self._at, what, model, field, recorded, replayed))


def device_name(line: str, address: int) -> str:
    """`i2c1 0x40`; of a port its own name."""
    return line if address < 0 else f"{line} 0x{address:02x}"


def shape_of(messages: Any) -> object:  # noqa: ANN401 -- of a bus or of a port
    """Return how much a transfer writes and reads, and in which order."""
    if isinstance(messages, bytes):
        return None
    return tuple(each if isinstance(each, int) else -len(each) for each in messages)


_LONGEST: Final = SECOND
"""More than any line runs ahead of a step."""


class OpenFeed(Feed):
    """`asked` are the transfers of the section so far, as they were asked for."""

    def __init__(self, header: Header, report: Report) -> None:
        self.asked: list[Transfer] = []
        self._held: dict[object, Transfer] = {}
        """The last answers, by request."""
        self._world_left: list[tuple[int, object]] | None = None
        super().__init__(header, report)

    def load(self, section: Section) -> None:
        """Give what this section holds from now on."""
        super().load(section)
        self._last_reading = section.at
        self.asked.clear()
        self._world_left = None

    def load_nothing(self, at: int) -> None:
        """Give what there is for an instant of which nothing was recorded."""
        self.load(Section(Kind.STEP, at, [], [], [], [], msgspec.Raw(b"\x90"), [], []))
        self._asked_too_much = True  # which the step itself says

    def check_all_taken(self) -> None:
        """Report what was not asked for, and keep its answers for a later request."""
        for transfer in reversed(self._transfers):
            self._hold(transfer)
        super().check_all_taken()

    def time(self) -> int:
        """Return the next time of the lines; the step's own instant if there is no more."""
        return next(self._times, self._at)

    def elapsed(self) -> int:
        """Return how far the lines had run ahead of the step; 0 if they did not say."""
        said = next(self._times, 0)
        return 0 if said > _LONGEST else said  # an instant, in place of a span

    def world_sent(self, _place: int, numbers: Container[int]) -> object:
        """Return what the world sent next by a port of these."""
        if self._world_left is None:
            self._world_left = list(self.sent())
        for place, each in enumerate(self._world_left):
            if each[0] in numbers:
                return self._world_left.pop(place)
        return None

    def transfer(self, line: int, address: int, messages: object) -> Transfer | None:
        """Return such a transfer, of here or the last one; None if there was none."""
        self.asked.append(Transfer(line, address, messages, b"", self._at))
        request = _request(line, address, messages)
        place = self._place_of(request, line, address, messages)
        if place is None:
            self._differs("write", *self._named(self.asked[-1]), "nothing", messages)
            return self._held.get(request) or self._held.get((line, address, shape_of(messages)))
        recorded = self._transfers.pop(place)
        self._hold(recorded)
        if recorded.messages != messages:
            self._differs("write", *self._named(self.asked[-1]), recorded.messages, messages)
        return recorded

    def _place_of(self, request: object, line: int, address: int, messages: object) -> int | None:
        """The same request in this section; one of the same shape if no answer is held for it."""
        for place in range(len(self._transfers) - 1, -1, -1):
            each = self._transfers[place]
            if _request(each.line, each.address, each.messages) == request:
                return place
        if request in self._held and _reads(messages):
            return None
        return self._place(line, address, messages)

    def _hold(self, transfer: Transfer) -> None:
        line, address, messages = transfer.line, transfer.address, transfer.messages
        if _reads(messages):
            self._held[_request(line, address, messages)] = transfer
            self._held[(line, address, shape_of(messages))] = transfer


def _request(line: int, address: int, messages: Any) -> object:  # noqa: ANN401 -- of bus or port
    if isinstance(messages, bytes):
        return line, address, messages
    return line, address, tuple(each if isinstance(each, int) else bytes(each) for each in messages)


def _reads(messages: Any) -> bool:  # noqa: ANN401 -- as above
    return not isinstance(messages, bytes) and any(isinstance(each, int) for each in messages)
