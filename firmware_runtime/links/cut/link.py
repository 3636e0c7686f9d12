"""A run's end of a link: values of the ports of a cut, to and from the run of the other part.

It is a source of the executive's loop and a hook of its run. What left in a step is sent right
after it, before the loop waits again; what arrives of a step is one event of the next pass.
Nothing waits: what finds no room is dropped and counted, and one pass reads `AT_ONCE` frames.
"""

from collections.abc import Callable, Mapping, Sequence
from secrets import randbits
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.inbox import Bag, EventSource
from firmware_runtime.links.cut.channel import Channel, ChannelClosed
from firmware_runtime.links.cut.counts import Counts, LinkMeter, report_of
from firmware_runtime.links.cut.cut import Crossing, Cut, Terms
from firmware_runtime.links.cut.delivery import Delivery
from firmware_runtime.links.cut.outbox import Outbox
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.sender import Departures, Sender
from firmware_runtime.links.cut.wire import Farewell, Frame, Greeting, Kind, decoded
from firmware_runtime.system.this_process import boot_id

AT_ONCE: Final = 64
"""How many frames are read in one pass of the loop."""
_UNACCEPTED: Final = "what this end sends does not arrive at the other"


class Link(EventSource):
    """One end; `takes_old` says that retained values enter however old: it drives nothing.

    `time` is CLOCK_MONOTONIC. `on_bad` is called with a reason when the link turns bad or was
    interrupted, `on_bye` with what the other end said when it ended, and `on_closed` when there is
    no way to it any more.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the session
        self,
        executive: Executive,
        cut: Cut,
        entering: Mapping[str, InPort[object]],
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
        self.on_bad: Callable[[str], None] = lambda _: None
        self.on_bye: Callable[[Farewell], None] = lambda _: None
        self.on_closed: Callable[[], None] = lambda: None
        self.why_silent: Callable[[int], str | None] = lambda _now: None
        """Why this end is to fall silent at an instant of the run, so that the other switches off;
        None while it is not."""
        self._executive = executive
        self._time = time
        self._channel = channel
        self._log = log
        own = _greeting(cut, board, role, time() - executive.clock.now())
        self.peer = Peer(randbits(64) or 1, own, terms.timeout)
        counts = self.counts = Counts()
        numbers = {each.name: each.number for each in cut.leaving}
        self._outbox = Outbox(numbers, terms, counts)
        departures = Departures(executive.simulator)
        self._sender = Sender(channel, self.peer, departures, self._outbox, counts)
        ports = {each.number: (each, entering[each.name]) for each in cut.entering}
        self._delivery = Delivery(
            ports, terms, takes_old=takes_old, counts=counts, on_lost=self._interrupt
        )
        self._steps: list[Frame] = []
        self._was_good = False
        self._accepted_since = 0
        """Since when what this end says arrives, as far as is known; 0 before it was doubtful."""
        self._meter: LinkMeter | None = None
        self._refused_cut = ""
        self._has_said_taken = self._has_said_forged = False
        self._is_closed = False
        executive.add_source(self)
        executive.hooks.insert(0, self)

    def leaves(self, crossing: Crossing) -> Callable[[int, object], None]:
        """Return the listener of a port of the cut."""
        return self._sender.departures.listener(crossing)

    # What the loop asks for -----------------------------------------------------------------------

    def fileno(self) -> int:
        """The descriptor that becomes readable when a frame has come."""
        return self._channel.fileno()

    def events(self) -> Sequence[Bag]:
        """The steps that have come, in the order in which they left."""
        try:
            for datagram in self._channel.frames(AT_ONCE):
                try:
                    self._take(decoded(datagram))
                except Refused as refusal:
                    self._refuse(refusal)
        except ChannelClosed:
            self._close_down()
        if len(self._steps) > 1:
            self._steps.sort(key=lambda frame: frame.step)
        for frame in self._steps:
            try:
                self._take_step(frame)
            except Refused as refusal:
                self._refuse(refusal)
        self._steps.clear()
        return self._delivery.bags(self._age)

    def between_steps(self, now: int, _left: int) -> None:
        """Send what has left and what was lost; judge how the link stands."""
        if self._meter is None:  # the run has begun
            self._meter = LinkMeter(self._executive)
        sender, clock = self._sender, self._time()
        if sender.departures:
            sender.collect(clock - now)
        may_speak = self.why_silent(now) is None
        is_there = may_speak and self.peer.is_good(clock)
        lacks_at = self.lacks_at(clock)
        is_good = is_there and clock < min(sender.unaccepted_at, lacks_at)
        if self._was_good and not is_good:
            self._turn_bad(self._why_bad(clock) or "")
        self._was_good = is_good
        if not is_good:
            self._accepted_since = clock
        if is_there:
            turns_bad_at = min(self.peer.silent_at, sender.unaccepted_at, lacks_at)
            if is_good:
                self._executive.poll_by(now + turns_bad_at - clock)
            sender.send_steps(clock)
        else:
            self._outbox.expire(clock)
        if may_speak:
            sender.show_presence(clock, is_good=is_there)
        self._meter.write(self.counts, is_good=is_good, silences=self.peer.silences)

    # For arming, and at the end -------------------------------------------------------------------

    def lacks_at(self, clock: int) -> int:
        """The instant at which this end works by what is too old, by what the peer says."""
        missing = self.peer.missing
        if self._delivery.lacks(missing) is None:
            return NEVER
        age = self.peer.clock.age(clock, missing.since) or 0
        return clock - age + self.terms.timeout

    def why_not(self, _now: int) -> str | None:
        """Pre-arm check: the link must have been good for a while."""
        clock = self._time()
        if (why := self._why_bad(clock)) is not None:
            return f"the link is not good: {why}"
        good_for = clock - max(self.peer.good_since or clock, self._accepted_since)
        if good_for >= self.terms.good:
            return None
        expected = f"expected {self.terms.good / SECOND:g} s"
        return f"the link has been good for {good_for / SECOND:.1f} s only; {expected}"

    def say_goodbye(self, reason: str, *, is_over: bool, failed: bool) -> None:
        """Let the other end know that this one ends, and why."""
        self._sender.say_goodbye(self._time(), Farewell(reason, is_over, failed))

    def close(self) -> None:
        """Close the way to the other end."""
        self._channel.close()

    # ----------------------------------------------------------------------------------------------

    def _take(self, frame: Frame) -> None:
        """Raises Refused."""
        clock = self._time()
        session = self.peer.session_of_peer
        if frame.kind is Kind.REPORT:
            self.counts.carried = report_of(frame.body)
            self._say_if_forged()
            return
        if not self.peer.accept(frame, clock):
            self._say_if_taken()
            return
        if self.peer.session_of_peer != session:
            self._meet()
        self._outbox.note(frame)
        round_trip = self.peer.clock.round_trip
        if frame.echo != 0 and round_trip is not None and self._meter is not None:
            self._meter.note_round_trip(round_trip)
        if frame.kind is Kind.STEP:
            self._sender.owes_answer = True
            self._steps.append(frame)
        elif self.peer.farewell is not None:
            self.on_bye(self.peer.farewell)

    def _take_step(self, frame: Frame) -> None:
        """Raises Refused."""
        age = self._age(frame.origin)
        try:
            fresh = self._delivery.take(frame, age)
        except Refused as refusal:
            if refusal.reason is Reason.TOO_OLD:
                self._interrupt(str(refusal))
            raise
        if self._meter is not None:
            for _ in range(fresh):
                self._meter.note_age(age)

    def _why_bad(self, clock: int) -> str | None:
        """Return why the link is not good; None if it is."""
        if (why := self.peer.why_bad(clock)) is not None:
            return why
        if clock >= self._sender.unaccepted_at:
            return _UNACCEPTED
        if clock >= self.lacks_at(clock):
            return f"{self._delivery.lacks(self.peer.missing)} has left and does not arrive"
        return None

    def _age(self, origin: int) -> int:
        return self.peer.clock.age(self._time(), origin) or 0

    def _meet(self) -> None:
        """There is another peer: it knows nothing of ours, and counts from 1."""
        self._steps.clear()
        self._delivery.begin_again()
        self._outbox.begin_again()
        if self.peer.greeting is not None:
            self._log(f"link: {self.peer.greeting.role} of {self.peer.greeting.board} is there")

    def _say_if_taken(self) -> None:
        if self.peer.is_taken and not self._has_said_taken:
            self._log("link: the other end has another peer already: waiting for that to end")
        self._has_said_taken = self.peer.is_taken

    def _say_if_forged(self) -> None:
        """Once in a run, and only before there is a peer: what can be sent by all says no more."""
        is_alone = self.peer.greeting is None
        if is_alone and self.counts.refused[Reason.FORGED] > 0 and not self._has_said_forged:
            self._has_said_forged = True
            fault = "what comes is signed with another key, or comes from another address"
            self._log(f"link: {fault}; expected the same key at both ends; it is only counted now")

    def _refuse(self, refusal: Refused) -> None:
        self.counts.own[refusal.reason] += 1
        if refusal.reason is Reason.WENT_BACK:
            self._interrupt(f"a counter went back: {refusal}")
        elif refusal.reason is Reason.OTHER_CUT and str(refusal) != self._refused_cut:
            self._refused_cut = str(refusal)
            self._log(f"link: {refusal}")

    def _interrupt(self, why: str) -> None:
        """Take the link for bad, until it has been good for a while again."""
        self.peer.interrupt()
        self._turn_bad(why)

    def _turn_bad(self, why: str) -> None:
        self._was_good = False
        self.on_bad(why)

    def _close_down(self) -> None:
        if not self._is_closed:
            self._is_closed = True
            self._turn_bad("its carrier has ended")
            self.on_closed()


def _greeting(cut: Cut, board: str, role: str, started_at: int) -> Greeting:
    leaving = tuple(each.number for each in cut.leaving)
    return Greeting(cut.digest, leaving, board, role, boot_id(), started_at)
