"""What is to be sent: the newest values of each port, and those that have not arrived yet.

A value that left is sent once. Every frame of the peer says which frames it has accepted; a value
whose frame was lost, or that found no peer, is sent again until it is accepted, a newer one of its
port has left, or it is too old. A `retained` port's last value is never too old: an end that comes
later, or again, gets it.
"""

from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.links.cut.window import was_accepted
from firmware_runtime.links.cut.wire import Frame

_UNANSWERED = 100 * MILLISECOND
"""Ns after which a frame that the peer does not mention is taken for lost, at least."""


@dataclass(slots=True)
class Message:
    """A value on its way. `counter` is of the frame that it was sent in last; 0: it was not."""

    port: int
    origin: int
    sequence: int
    body: bytes
    counter: int = 0
    sent_at: int = 0


class Outbox:
    """Messages by port; `keep` of a port may wait to be sent, `retained` are numbers of ports."""

    def __init__(self, keep: int, retained: Collection[int], timeout: int) -> None:
        self.dropped = 0
        self._retained = frozenset(retained)
        self._keep = keep
        self._timeout = timeout
        self._sequences: dict[int, int] = {}
        self._waiting: dict[int, deque[Message]] = {}
        self._latest: dict[int, Message] = {}
        self._open: dict[int, Message] = {}

    def put(self, port: int, origin: int, body: bytes) -> None:
        """A value has left; of more than `keep` that wait, the oldest is dropped."""
        sequence = self._sequences[port] = self._sequences.get(port, 0) + 1
        waiting = self._waiting.setdefault(port, deque(maxlen=self._keep))
        self.dropped += len(waiting) == self._keep
        message = Message(port, origin, sequence, body)
        waiting.append(message)
        self._latest[port] = self._open[port] = message

    def take(self, now: int, round_trip: int) -> Iterator[Message]:
        """What is to be sent now: what waits, then what was lost; mark each when it was sent."""
        for waiting in self._waiting.values():
            while waiting:
                yield waiting.popleft()
        for port, message in list(self._open.items()):
            if port not in self._retained and now - message.origin > self._timeout:
                del self._open[port]
            elif message.counter == 0 or now - message.sent_at > _UNANSWERED + 2 * round_trip:
                yield message

    def discard(self) -> None:
        """Nothing can be sent now: what waits is the newest of each port only."""
        for waiting in self._waiting.values():
            self.dropped += max(len(waiting) - 1, 0)
            waiting.clear()

    def note(self, frame: Frame) -> None:
        """The peer says what it has accepted: what else was sent before that is lost."""
        for port, message in list(self._open.items()):
            if message.counter == 0 or message.counter > frame.seen:
                continue
            if was_accepted(message.counter, frame.seen, frame.seen_before):
                del self._open[port]
            else:
                message.counter = 0

    def begin_again(self) -> None:
        """There is another peer: it has none of what was sent before."""
        for message in self._latest.values():
            message.counter = 0
        self._open = dict(self._latest)
