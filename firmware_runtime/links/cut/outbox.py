"""Outbox of a link: of each port the last that left, and all that has not arrived yet.

What left by a port in a step is sent once, together with what left by the others. Every frame of
the peer says which frames it has accepted; what was in a frame that was lost, or found no peer, is
sent again until it is accepted, is too old, or `keep` newer ones of its port have left. Of an
`ordered` port each is sent until it is accepted or too old, `MOST_ORDERED` of a port at most, and
says which one has to enter before it. A `retained` port's last is never too old: an end that comes
later, or again, gets it. Nor is the last of any port that was sent and did not arrive, as long as
the peer is there: that works by an older one, and switches off once it knows. Until it has it, all
that is sent says since when it may be missing (`unaccepted`).
"""

from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.links.cut.unaccepted import Unaccepted
from firmware_runtime.links.cut.window import was_accepted
from firmware_runtime.links.cut.wire import Entry, Frame

MOST_ORDERED: Final = 256
"""How many of an ordered port may wait to be accepted."""
_UNANSWERED: Final = 100 * MILLISECOND
"""Ns after which a frame that the peer does not mention is taken for lost, at least."""


@dataclass(slots=True)
class Message:
    """Values that left by a port in a step. `counter`: of the latest frame with it; 0: of none."""

    step: int
    port: int
    origin: int
    sequence: int
    after: int
    values: int
    body: bytes
    is_connected: bool
    """Whether the other end was there when it left."""
    counter: int = 0
    sent_at: int = 0

    @property
    def entry(self) -> Entry:
        """Entry of a frame that bears it."""
        return Entry(self.port, self.sequence, self.after, self.body)


class Outbox:
    """Messages by port; `retained` and `ordered` are numbers of ports."""

    def __init__(
        self, keep: int, retained: Collection[int], ordered: Collection[int], timeout: int
    ) -> None:
        self.given_up = 0
        """Values that were never sent though the other end was there when they left, and those of
        ordered ports that were sent and did not arrive in time."""
        self.unconnected = 0
        """Values that left while there was no other end, or a silent one, and were never sent."""
        self.unaccepted = Unaccepted()
        self._keep = keep
        self._retained = frozenset(retained)
        self._ordered = frozenset(ordered)
        self._timeout = timeout
        self._is_connected = False
        self._sequences: dict[int, int] = {}
        self._open: dict[int, deque[Message]] = {}
        self._latest: dict[int, Message] = {}
        self._tails: dict[int, int] = {}
        """By ordered port, the sequence that the next one comes after."""

    @property
    def wants_answer(self) -> bool:
        """Return whether something of an ordered port is on its way."""
        return any(self._open.get(port) for port in self._ordered)

    def put(self, step: int, port: int, origin: int, values: int, body: bytes) -> None:
        """So many values have left by a port in a step."""
        sequence = self._sequences[port] = self._sequences.get(port, 0) + 1
        after = self._tails.get(port, 0)
        message = Message(step, port, origin, sequence, after, values, body, self._is_connected)
        self._latest[port] = message
        self.unaccepted.put(port, sequence, origin)
        waiting = self._open.setdefault(port, deque())
        waiting.append(message)
        if port in self._ordered:
            self._tails[port] = sequence
        if len(waiting) > (MOST_ORDERED if port in self._ordered else self._keep):
            self._give_up(waiting)

    def take(self, now: int, round_trip: int) -> Iterator[list[Message]]:
        """Yield what is to be sent now, by step; mark each when it was sent."""
        self._is_connected = True
        self._expire(now, is_good=True)
        patience = _UNANSWERED + 2 * round_trip
        steps: dict[int, list[Message]] = {}
        for waiting in self._open.values():
            for message in waiting:
                if message.counter == 0 or now - message.sent_at > patience:
                    steps.setdefault(message.step, []).append(message)
        for step in sorted(steps):
            yield steps[step]

    def expire(self, now: int) -> None:
        """Give up what is too old: there is no peer, or it is silent."""
        self._is_connected = False
        self._expire(now, is_good=False)

    def _expire(self, now: int, *, is_good: bool) -> None:
        for port, waiting in self._open.items():
            while waiting and now - waiting[0].origin > self._timeout:
                is_latest = waiting[0] is self._latest.get(port)
                if is_latest and (port in self._retained or (is_good and waiting[0].sent_at != 0)):
                    break
                self._give_up(waiting)
            if not waiting:  # what was given up counts as missing for as long again
                self.unaccepted.forget(port, now - 2 * self._timeout)

    def note(self, frame: Frame) -> None:
        """The peer says what it has accepted: what else was sent before that is lost."""
        self.unaccepted.note(frame)
        for port, waiting in self._open.items():
            accepted = []
            for message in waiting:
                if 0 < message.counter <= frame.seen:
                    if was_accepted(message.counter, frame.seen, frame.seen_before):
                        accepted.append(message.sequence)
                    else:
                        message.counter = 0
            if accepted:
                self._close(port, waiting, accepted)

    def begin_again(self) -> None:
        """There is another peer: it has none of what was sent before."""
        for port, waiting in self._open.items():
            latest = self._latest.get(port)
            is_of_use = port not in self._ordered or port in self._retained
            if not waiting and is_of_use and latest is not None:
                waiting.append(latest)
            for message in waiting:
                message.counter = 0
            if port in self._ordered:
                self._chain(port, waiting)
        open_ = {port: [(m.sequence, m.origin) for m in each] for port, each in self._open.items()}
        self.unaccepted.begin_again(open_)

    def _chain(self, port: int, waiting: deque[Message]) -> None:
        """Let each come after the one before it, and the first after none."""
        tail = 0
        for message in waiting:
            message.after, tail = tail, message.sequence
        self._tails[port] = tail

    def _close(self, port: int, waiting: deque[Message], accepted: Collection[int]) -> None:
        """Forget what was accepted, and what is of no use after it."""
        is_ordered, newest = port in self._ordered, max(accepted)
        kept = [
            message
            for message in waiting
            if message.sequence not in accepted and (is_ordered or message.sequence > newest)
        ]
        waiting.clear()
        waiting.extend(kept)

    def _give_up(self, waiting: deque[Message]) -> None:
        """Forget the oldest; what comes after it comes after the one before it, then."""
        lost = waiting.popleft()
        if self._latest.get(lost.port) is lost:
            del self._latest[lost.port]
        is_ordered = lost.port in self._ordered
        if lost.sent_at == 0 and not lost.is_connected:
            self.unconnected += lost.values
        elif is_ordered or lost.sent_at == 0:
            self.given_up += lost.values
        if not is_ordered:
            return
        if waiting and waiting[0].after == lost.sequence:
            waiting[0].after = lost.after
        if self._tails[lost.port] == lost.sequence:
            self._tails[lost.port] = lost.after
