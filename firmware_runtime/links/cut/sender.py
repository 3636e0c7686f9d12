"""Sender of one end of a link: what left its model, what was lost, greetings, heartbeats.

Nothing waits: what finds no room is counted, and sent again where that is of use.
"""

from collections import deque
from collections.abc import Callable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import Final, TypeAlias

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.links.cut.channel import Channel
from firmware_runtime.links.cut.counts import Counts
from firmware_runtime.links.cut.cut import Crossing
from firmware_runtime.links.cut.outbox import Outbox
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.wire import (
    BYES,
    HEAD,
    LONGEST_BODY,
    Farewell,
    Frame,
    Kind,
    body_of,
    encoded,
)

HELLO_EVERY: Final = 20 * MILLISECOND
"""Ns from one greeting to the next, at least."""
SEEK_EVERY: Final = 100 * MILLISECOND
"""Ns from one greeting to the next while there is no other end."""
ANSWER_WITHIN: Final = 20 * MILLISECOND
"""Ns after which the peer learns what has arrived, if nothing else is sent to it; after which it is
asked what has, where something of an ordered port is on its way."""


Left: TypeAlias = dict[Crossing, list[object]]
"""What left in a step, by crossing."""
_place: Final = itemgetter(0)


class Departures:
    """Listens at ports of the cut, for as long as the simulator lives."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._left: deque[tuple[tuple[int, int, int], Crossing, object]] = deque()

    def __bool__(self) -> bool:
        """Return whether something has left."""
        return bool(self._left)

    def listener(self, crossing: Crossing) -> Callable[[int, object], None]:
        """Return the listener at the port of a crossing."""
        left, simulator = self._left, self._simulator

        def take(at: int, value: object) -> None:
            left.append(((at, simulator.visit, simulator.round), crossing, value))

        return take

    def steps(self) -> Iterator[tuple[int, Left]]:
        """The steps since the last call: the instant of each, and what left in it."""
        everything = list(self._left)
        self._left.clear()
        for place, departed in groupby(everything, _place):
            left: Left = {}
            for _, crossing, value in departed:
                left.setdefault(crossing, []).append(value)
            yield place[0], left


def packed(left: Left) -> Iterator[tuple[Crossing, int, bytes]]:
    """By crossing how many values left in a step, and their bytes.

    Raises ModelError for what no frame has room for.
    """
    room = LONGEST_BODY
    for crossing, values in left.items():
        body = crossing.packed(values)
        room -= HEAD + len(body)
        if room < 0:
            names = ", ".join(each.name for each in left)
            fault = f"{names}: more left in one step than crosses a link in one frame"
            raise ModelError(fault, expected=f"{LONGEST_BODY} bytes at most, the rest later")
        yield crossing, len(values), body


class Sender:
    """The way out of one end; `owes_answer` says that a step has arrived since it spoke."""

    def __init__(
        self, channel: Channel, peer: Peer, departures: Departures, outbox: Outbox, counts: Counts
    ) -> None:
        self.departures = departures
        self.outbox = outbox
        self.owes_answer = False
        self._counts = counts
        self._channel = channel
        self._peer = peer
        self._heartbeat_every = min(peer.timeout // 5, 100 * MILLISECOND)
        self._sent_at = self._hello_at = 0
        self._step = 0

    @property
    def unaccepted_at(self) -> int:
        """The instant from which steps count as lost on the way, unless the peer accepts one."""
        if self.outbox.waits_since is None:
            return NEVER
        answered_within = (self._peer.clock.round_trip or 0) + ANSWER_WITHIN
        return self.outbox.waits_since + self._peer.timeout + answered_within

    def collect(self, offset: int) -> None:
        """Take up what has left; `offset` is CLOCK_MONOTONIC at instant 0 of the run."""
        for at, left in self.departures.steps():
            self._step += 1
            for crossing, values, body in packed(left):
                self.outbox.put(self._step, crossing.number, offset + at, values, body)

    def send_steps(self, clock: int) -> None:
        """Send what waits and what was lost."""
        for messages in self.outbox.take(clock, self._peer.clock.round_trip or 0):
            first = messages[0]
            frame = self._peer.frame(Kind.STEP, clock)._replace(
                ports=len(messages),
                origin=first.origin,
                step=first.step,
                missing=self.outbox.oldest,
                body=body_of(each.entry for each in messages),
            )
            if self._send(frame):
                self.outbox.note_sent(messages, frame.counter, clock)

    def show_presence(self, clock: int, *, is_good: bool) -> None:
        """Greet, or show that this end lives, where nothing else has."""
        greets = self._peer.wants_hello or not is_good
        if greets and clock - self._hello_at >= self._hello_every:
            self._hello_at = clock
            self._send(self._peer.hello(clock))
        elif is_good and clock - self._sent_at >= self._speak_every:
            heartbeat = self._peer.frame(Kind.HEARTBEAT, clock)
            self._send(heartbeat._replace(missing=self.outbox.oldest))

    def say_goodbye(self, clock: int, farewell: Farewell) -> None:
        """Let the other end know that this one ends; more than once, one may be lost."""
        if self._peer.session_of_peer != 0:
            self._channel.linger()
            for _ in range(BYES):
                self._send(self._peer.bye(clock, farewell))

    # ----------------------------------------------------------------------------------------------

    @property
    def _hello_every(self) -> int:
        return HELLO_EVERY if self._peer.wants_hello else SEEK_EVERY

    @property
    def _speak_every(self) -> int:
        asks = self.owes_answer or self.outbox.wants_answer
        return ANSWER_WITHIN if asks else self._heartbeat_every

    def _send(self, frame: Frame) -> bool:
        """Send a frame; whether there was room for it, and an end to take it."""
        try:
            self._channel.send(encoded(frame))
        except OSError:
            self._counts.unsent += 1
            return False
        self._sent_at = frame.sent_at
        self.owes_answer = False
        return True
