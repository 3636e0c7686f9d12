"""The feed of an open loop: answers code that asks otherwise than was recorded.

A transfer gets the recorded answer to the same request in this section, else the last answer to the
same request, else that to one of the same shape; a device that was never read so does not
acknowledge. Clock, interlock and lines go on from what they said last.
"""

from collections.abc import Container
from typing import Any, Final

import msgspec

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.header import Header
from firmware_runtime.recording.blackbox.section import Kind, Section, Transfer
from firmware_runtime.recording.replay.feed import Feed, Report, shape_of

_LONGEST: Final = SECOND
"""More than any line runs ahead of a step."""


class OpenFeed(Feed):
    """`asked` are the transfers of the section so far, as they were asked for."""

    def __init__(self, header: Header, report: Report) -> None:
        self.asked: list[Transfer] = []
        self._held: dict[object, Transfer] = {}
        """The last answers, by request."""
        self._world_left: list[tuple[int, Any]] | None = None
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
        for transfer in self._transfers:
            self._hold(transfer)
        super().check_all_taken()

    def time(self) -> int:
        """What the lines said of their time; the step's own instant if they said no more."""
        return next(self._times, self._at)

    def elapsed(self) -> int:
        """How far the lines said they had run ahead of the step; 0 if they did not."""
        said = next(self._times, 0)
        return 0 if said > _LONGEST else said  # an instant, in place of a span

    def world_sent(self, _place: int, numbers: Container[int]) -> Any:  # noqa: ANN401 -- a form
        """What the world sent next by a port of these."""
        if self._world_left is None:
            self._world_left = list(self.sent())
        for place, each in enumerate(self._world_left):
            if each[0] in numbers:
                return self._world_left.pop(place)
        return None

    def transfer(self, line: int, address: int, messages: Any) -> Transfer | None:  # noqa: ANN401
        """How such a transfer ended, here or when there was one last; None if there was none."""
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

    def _place_of(self, request: object, line: int, address: int, messages: Any) -> int | None:  # noqa: ANN401
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
