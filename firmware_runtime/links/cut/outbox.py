"""Outbox of a link: of each port the last that left, and all that has not arrived yet.

What left by a port in a step is sent once, together with what left by the others. Every frame of
the peer says which frames it has accepted; what was in a frame that was lost, or found no peer, is
sent again until it is accepted, is too old, or `keep` newer ones of its port have left. Of an
`ordered` port each is sent until it is accepted or too old, `MOST_ORDERED` of a port at most, and
says which one has to enter before it. A `retained` port's last is never too old: an end that comes
later, or again, gets it. Nor is the last of any port that was sent and did not arrive, as long as
the peer is there: that works by an older one, and switches off once it knows.

A path that loses steps towards the other end, and lets signs of life pass, leaves it working by
what is old. So all that is sent says since when something may be missing (`oldest`): a newer value
takes the place of one that was lost, but what is missing is so since the first of them left. A path
that loses every step of a stream is noticed like one that loses a single one.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.links.cut.counts import Counts
from firmware_runtime.links.cut.cut import Terms
from firmware_runtime.links.cut.window import SHOWN, was_accepted
from firmware_runtime.links.cut.wire import NOTHING_MISSING, Entry, Frame, Missing

MOST_ORDERED: Final = 256
"""How many of an ordered port may wait to be accepted."""
_MOST_REMEMBERED: Final = 1024
"""Values of a port, and frames with values, that are remembered."""
_UNANSWERED: Final = 100 * MILLISECOND
"""Ns after which a frame that the peer does not mention is taken for lost, at least."""


@dataclass(slots=True, eq=False)
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


class _Sent(NamedTuple):
    """A frame with values, by its counter, and when it was sent."""

    counter: int
    at: int
    messages: list[Message]


class Outbox:
    """Messages by port, of these names and numbers; instants in ns by this end's clock."""

    def __init__(self, numbers: Mapping[str, int], terms: Terms, counts: Counts) -> None:
        self.waits_since: int | None = None
        """When the oldest step was sent after the latest that was accepted; None: there is none."""
        self._keep, self._timeout = terms.keep, terms.timeout
        self._retained = {number for name, number in numbers.items() if name in terms.retain}
        self._ordered = {number for name, number in numbers.items() if name in terms.ordered}
        self._counts = counts
        self._is_connected = False
        self._sequences: dict[int, int] = {}
        self._open: dict[int, deque[Message]] = {}
        self._latest: dict[int, Message] = {}
        self._tails: dict[int, int] = {}
        """By ordered port, the sequence that the next one comes after."""
        self._missing: dict[int, deque[Missing]] = {}
        self._sent: deque[_Sent] = deque(maxlen=_MOST_REMEMBERED)

    @property
    def wants_answer(self) -> bool:
        """Return whether something of an ordered port is on its way."""
        return any(self._open.get(port) for port in self._ordered)

    @property
    def oldest(self) -> Missing:
        """The value that the other end may lack for longest."""
        first = (missing[0] for missing in self._missing.values() if missing)
        return min(first, key=lambda each: each.since, default=NOTHING_MISSING)

    def put(self, step: int, port: int, origin: int, values: int, body: bytes) -> None:
        """So many values have left by a port in a step."""
        sequence = self._sequences[port] = self._sequences.get(port, 0) + 1
        after = self._tails.get(port, 0)
        message = Message(step, port, origin, sequence, after, values, body, self._is_connected)
        self._latest[port] = message
        missing = self._missing.setdefault(port, deque())
        if len(missing) < _MOST_REMEMBERED:
            missing.append(Missing(origin, sequence, port))
        waiting = self._open.setdefault(port, deque())
        waiting.append(message)
        if port in self._ordered:
            self._tails[port] = sequence
        if len(waiting) > (MOST_ORDERED if port in self._ordered else self._keep):
            self._give_up(waiting)

    def take(self, now: int, round_trip: int) -> Iterator[list[Message]]:
        """Yield what is to be sent now, by step; say of each by `note_sent` that it was."""
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

    def note_sent(self, messages: list[Message], counter: int, at: int) -> None:
        """Note that these were sent at an instant, in the frame with this counter."""
        for message in messages:
            if message.sent_at == 0:
                self._counts.sent += message.values
            else:
                self._counts.repeated += message.values
            message.counter, message.sent_at = counter, at
        self._sent.append(_Sent(counter, at, messages))
        if self.waits_since is None:
            self.waits_since = at

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
            missing = self._missing[port]
            if not waiting:  # what was given up counts as missing for as long again
                while missing and missing[0].since < now - 2 * self._timeout:
                    missing.popleft()

    def note(self, frame: Frame) -> None:
        """The peer says what it has accepted: what else was sent before that is lost."""
        sent, newest = self._sent, 0
        doubtful: list[_Sent] = []
        while sent and sent[0].counter <= frame.seen:
            each = sent.popleft()
            if was_accepted(each.counter, frame.seen, frame.seen_before):
                newest = each.counter
                for message in each.messages:
                    self._close(message)
                continue
            for message in each.messages:
                if message.counter == each.counter:
                    message.counter = 0
            if each.counter >= frame.seen - SHOWN:  # it may have been overtaken
                doubtful.append(each)
        sent.extendleft(reversed(doubtful))
        if newest > 0:
            self.waits_since = next((each.at for each in sent if each.counter > newest), None)

    def begin_again(self) -> None:
        """There is another peer: it has none of what was sent before, and gets what waits."""
        self._sent.clear()
        self.waits_since = None
        for port, waiting in self._open.items():
            latest = self._latest.get(port)
            is_of_use = port not in self._ordered or port in self._retained
            if not waiting and is_of_use and latest is not None:
                waiting.append(latest)
            tail = 0
            for message in waiting:
                message.counter = 0
                if port in self._ordered:  # each after the one before it, the first after none
                    message.after, tail = tail, message.sequence
            if port in self._ordered:
                self._tails[port] = tail
            self._missing[port] = deque(Missing(m.origin, m.sequence, port) for m in waiting)

    def _close(self, message: Message) -> None:
        """Forget what was accepted, and what is of no use after it."""
        missing, waiting = self._missing[message.port], self._open[message.port]
        while missing and missing[0].sequence <= message.sequence:
            missing.popleft()
        if message.port not in self._ordered:
            while waiting and waiting[0].sequence <= message.sequence:
                waiting.popleft()
        elif message in waiting:
            waiting.remove(message)

    def _give_up(self, waiting: deque[Message]) -> None:
        """Forget the oldest; what comes after it comes after the one before it, then."""
        lost = waiting.popleft()
        lost.body = b""  # the frames that it was sent in are remembered for longer
        if self._latest.get(lost.port) is lost:
            del self._latest[lost.port]
        is_ordered = lost.port in self._ordered
        if lost.sent_at == 0 and not lost.is_connected:
            self._counts.unconnected += lost.values
        elif is_ordered or lost.sent_at == 0:
            self._counts.given_up += lost.values
        if not is_ordered:
            return
        if waiting and waiting[0].after == lost.sequence:
            waiting[0].after = lost.after
        if self._tails[lost.port] == lost.sequence:
            self._tails[lost.port] = lost.after
