"""A run's end of a link: values of the ports of a cut, to and from the run of the other part.

It is a source of the executive's loop and a hook of its run. A value that left in a step is sent
right after it, before the loop waits again; one that arrives is an external event of the next pass.
Nothing waits: what finds no room is dropped and counted, and one pass reads `AT_ONCE` frames.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from secrets import randbits
from time import monotonic_ns
from typing import Any, Final

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.loop import Executive
from firmware_runtime.links.cut.channel import Channel, ChannelClosed, frames
from firmware_runtime.links.cut.counts import Counts, report_of
from firmware_runtime.links.cut.cut import Crossing, Cut
from firmware_runtime.links.cut.greeting import Farewell, Greeting
from firmware_runtime.links.cut.meter import LinkMeter
from firmware_runtime.links.cut.outbox import Message, Outbox
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.wire import Frame, Kind, decoded, encoded
from firmware_runtime.system.process_identity import boot_id

AT_ONCE: Final = 64
"""How many frames are read in one pass of the loop."""
HELLO_EVERY: Final = 20 * MILLISECOND
"""Ns from one greeting to the next, at least."""
SEEK_EVERY: Final = 100 * MILLISECOND
"""Ns from one greeting to the next while there is no other end."""
ANSWER_WITHIN: Final = 20 * MILLISECOND
"""Ns after which the peer learns what has arrived, if nothing else is sent to it."""
_BYES: Final = 3


@dataclass(frozen=True, slots=True)
class Terms:
    """The terms of a link: `[link]` of the board, in ns, and which ports are retained."""

    timeout: int = SECOND // 2
    good: int = SECOND // 2
    keep: int = 1
    retain: frozenset[str] = frozenset()


class Link:
    """One end; `takes_old` says that retained values enter however old: it drives nothing.

    `time` is CLOCK_MONOTONIC. `on_bad` is called with a reason when the link turns bad or was
    interrupted, `on_bye` with what the other end said when it ended, and `on_closed` when there is
    no way to it any more.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the session
        self,
        executive: Executive,
        cut: Cut,
        entering: Mapping[str, InPort[Any]],
        channel: Channel,
        terms: Terms,
        *,
        board: str,
        role: str,
        takes_old: bool,
        log: Callable[[str], None],
        time: Callable[[], int] = monotonic_ns,
    ) -> None:
        self.cut = cut
        self.terms = terms
        self.counts = Counts()
        self.ages: dict[str, int] = {}
        """By crossing, how old its latest value was when it arrived, ns; none before the clocks of
        both ends have been compared."""
        self.on_bad: Callable[[str], None] = lambda _: None
        self.on_bye: Callable[[Farewell], None] = lambda _: None
        self.on_closed: Callable[[], None] = lambda: None
        self._executive = executive
        self._time = time
        self._channel = channel
        self._log = log
        self._takes_old = takes_old
        self._ports = {each.number: (each, entering[each.name]) for each in cut.entering}
        self._taken: dict[int, int] = {}
        retained = [each.number for each in cut.leaving if each.name in terms.retain]
        self._outbox = Outbox(terms.keep, retained, terms.timeout)
        self._left: deque[tuple[Crossing, int, object]] = deque()
        own = Greeting(
            cut.digest,
            tuple(each.number for each in cut.leaving),
            board,
            role,
            boot_id(),
            time() - executive.clock.now(),
        )
        self.peer = Peer(randbits(64) or 1, own, terms.timeout)
        self._heartbeat_every = min(terms.timeout // 5, 100 * MILLISECOND)
        self._sent_at = self._hello_at = 0
        self._owes_answer = False
        self._was_good = False
        self._meter: LinkMeter | None = None
        self._refused_cut = ""
        self._is_closed = False
        executive.add_source(self)
        executive.hooks.insert(0, self)

    def leaves(self, crossing: Crossing) -> Callable[[int, object], None]:
        """What listens at a port of the cut."""
        left = self._left

        def take(at: int, value: object) -> None:
            left.append((crossing, at, value))

        return take

    # What the loop asks for -----------------------------------------------------------------------

    def fileno(self) -> int:
        """The descriptor that becomes readable when a frame has come."""
        return self._channel.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """The values that have come; of each port the newest `keep`."""
        arrived: list[tuple[InPort[Any], object]] = []
        try:
            for datagram in frames(self._channel, AT_ONCE):
                try:
                    self._take(decoded(datagram), arrived)
                except Refused as refusal:
                    self._refuse(refusal)
        except ChannelClosed:
            self._close_down()
        return self._newest(arrived)

    def between_steps(self, now: int, _left: int) -> None:
        """Send what has left and what was lost; judge how the link stands."""
        if self._meter is None:  # the run has begun
            self._meter = LinkMeter(self._executive)
        clock = self._time()
        while self._left:
            crossing, at, value = self._left.popleft()
            self._outbox.put(crossing.number, clock - now + at, crossing.packed(value))
        is_good = self.peer.is_good(clock)
        if self._was_good and not is_good:
            self._turn_bad(self.peer.why_bad(clock) or "")
        self._was_good = is_good
        if is_good:
            self._executive.poll_by(now + self.peer.silent_at - clock)
            for message in self._outbox.take(clock, self.peer.clock.round_trip or 0):
                self._send_value(message, clock)
        else:
            self._outbox.discard()
        self._show_presence(clock, is_good=is_good)
        self.counts.replaced = self._outbox.dropped
        self._meter.write(self.counts, is_good=is_good, silences=self.peer.silences)

    # For arming, and at the end -------------------------------------------------------------------

    def why_not(self, _now: int) -> str | None:
        """Pre-arm check: the link must have been good for a while."""
        clock = self._time()
        if (why := self.peer.why_bad(clock)) is not None:
            return f"the link is not good: {why}"
        good_for = clock - (self.peer.good_since or clock)
        if good_for >= self.terms.good:
            return None
        expected = f"expected {self.terms.good / SECOND:g} s"
        return f"the link has been good for {good_for / SECOND:.1f} s only; {expected}"

    def say_goodbye(self, reason: str, *, is_over: bool, failed: bool) -> None:
        """Let the other end know that this one ends, and why; more than once, one may be lost."""
        farewell = Farewell(reason, is_over, failed)
        if self.peer.session_of_peer != 0:
            for _ in range(_BYES):
                self._send(self.peer.bye(self._time(), farewell))

    def close(self) -> None:
        """Close the way to the other end."""
        self._channel.close()

    # ----------------------------------------------------------------------------------------------

    def _take(self, frame: Frame, arrived: list[tuple[InPort[Any], object]]) -> None:
        """Raises Refused."""
        clock = self._time()
        session = self.peer.session_of_peer
        if frame.kind is Kind.REPORT:
            self.counts.carried = report_of(frame.body)
            return
        if not self.peer.accept(frame, clock):
            return
        if self.peer.session_of_peer != session:
            self._meet()
        self._outbox.note(frame)
        round_trip = self.peer.clock.round_trip
        if frame.echo != 0 and round_trip is not None and self._meter is not None:
            self._meter.note_round_trip(round_trip)
        if frame.kind is Kind.VALUE:
            self._owes_answer = True
            arrived += self._value(frame, clock)
        elif self.peer.farewell is not None:
            self.on_bye(self.peer.farewell)

    def _value(self, frame: Frame, clock: int) -> list[tuple[InPort[Any], object]]:
        """The value that a frame bears; none if it has been taken before. Raises Refused."""
        if frame.port not in self._ports:
            raise Refused(Reason.UNKNOWN_PORT, str(frame.port))
        crossing, port = self._ports[frame.port]
        if frame.sequence <= self._taken.get(frame.port, 0):
            return []
        known = self.peer.clock.age(clock, frame.origin)
        age = known or 0
        is_retained = self._takes_old and crossing.name in self.terms.retain
        if age > self.terms.timeout and not is_retained:
            old = f"{crossing.name} was {age / SECOND:.3f} s old"
            self.peer.interrupt()
            self._turn_bad(old)
            raise Refused(Reason.TOO_OLD, old)
        value = crossing.packing.unpack(frame.body, crossing.limits)
        self._taken[frame.port] = frame.sequence
        if self._meter is not None:
            self._meter.note_age(age)
        if known is not None:
            self.ages[crossing.name] = known
        return [(port, value)]

    def _newest(
        self, arrived: list[tuple[InPort[Any], object]]
    ) -> Sequence[tuple[InPort[Any], object]]:
        """Of what arrived in one pass the newest of each port, in order."""
        kept: list[tuple[InPort[Any], object]] = []
        of_port: dict[InPort[Any], int] = {}
        for port, value in reversed(arrived):
            of_port[port] = of_port.get(port, 0) + 1
            if of_port[port] <= self.terms.keep:
                kept.append((port, value))
        self.counts.received += len(kept)
        self.counts.dropped += len(arrived) - len(kept)
        return kept[::-1]

    def _meet(self) -> None:
        """There is another peer: it knows nothing of ours, and counts its values from 1."""
        self._taken.clear()
        self._outbox.begin_again()
        if self.peer.greeting is not None:
            self._log(f"link: {self.peer.greeting.role} of {self.peer.greeting.board} is there")

    def _refuse(self, refusal: Refused) -> None:
        self.counts.own[refusal.reason] += 1
        if refusal.reason is Reason.WENT_BACK:
            self.peer.interrupt()
            self._turn_bad(f"a counter went back: {refusal}")
        elif refusal.reason is Reason.OTHER_CUT and str(refusal) != self._refused_cut:
            self._refused_cut = str(refusal)
            self._log(f"link: {refusal}")

    def _turn_bad(self, why: str) -> None:
        self._was_good = False
        self.on_bad(why)

    def _send_value(self, message: Message, clock: int) -> None:
        frame = self.peer.frame(
            Kind.VALUE,
            clock,
            port=message.port,
            origin=message.origin,
            sequence=message.sequence,
            body=message.body,
        )
        is_again = message.sent_at != 0
        if self._send(frame):
            message.counter, message.sent_at = frame.counter, clock
            self.counts.repeated += is_again
            self.counts.sent += not is_again

    def _show_presence(self, clock: int, *, is_good: bool) -> None:
        """Greet, or show that this end lives, where nothing else has."""
        greeted, spoken = clock - self._hello_at, clock - self._sent_at
        if greeted >= (HELLO_EVERY if self.peer.wants_hello else SEEK_EVERY) and (
            self.peer.wants_hello or not is_good
        ):
            self._hello_at = clock
            self._send(self.peer.hello(clock))
        elif is_good and spoken >= (ANSWER_WITHIN if self._owes_answer else self._heartbeat_every):
            self._send(self.peer.frame(Kind.HEARTBEAT, clock))

    def _send(self, frame: Frame) -> bool:
        """Send a frame; whether there was room for it, and an end to take it."""
        try:
            self._channel.send(encoded(frame))
        except OSError:
            self.counts.unsent += 1
            return False
        self._sent_at = frame.sent_at
        self._owes_answer = False
        return True

    def _close_down(self) -> None:
        if not self._is_closed:
            self._is_closed = True
            self._turn_bad("its carrier has ended")
            self.on_closed()
