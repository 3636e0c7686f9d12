"""Peer of one end of a link: its session, counters and clock, and whether it is silent.

Protocol without I/O: frames and instants of CLOCK_MONOTONIC in, frames out.

    no peer --hello of the same cut, then any frame that names our session--> peer
    peer --said nothing for `timeout`, or a bye--> silent peer --a frame of its session--> peer
    silent peer --as from no peer, of another session--> another peer

A silence begins when the last frame was sent, not when it arrived: what carries it on may be slow,
and the end that sent it have died meanwhile.

Two ends that are silent to each other greet any end, and answer each other's greetings by name.

A session is 64 random bits. A frame that names another session of ours than the present one, or
comes from one that is not our peer's, is refused; so is a counter that was accepted before.
Another session takes the place of the peer only when that is silent, and one that was our peer
before never comes back: what was recorded of it is worth nothing.
"""

from collections import deque
from typing import Final, NamedTuple

from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.window import Window
from firmware_runtime.links.cut.wire import (
    NOTHING_MISSING,
    Farewell,
    Frame,
    Greeting,
    Kind,
    encode,
    farewell_of,
    greeting_of,
)

_WINDOW: Final = 4 * SECOND
_SLACK: Final = MILLISECOND
"""Ns by which clocks that are one may seem to differ."""


class _Estimate(NamedTuple):
    round_trip: int
    offset: int


class PeerClock:
    """Offset of the peer's CLOCK_MONOTONIC: what it shows less what ours shows, ns.

    Each frame carries the instant of the latest frame that its sender has accepted, and how long
    that was held. So the time both ways is known by one clock; half of it is taken for the way
    here. The estimate of the shortest round trip of the last seconds counts: it has least room for
    error. `is_same` says that both ends run on one machine: then the offset is none, as long as the
    estimate does not contradict that.
    """

    def __init__(self, *, is_same: bool) -> None:
        self.round_trip: int | None = None
        """The latest, ns; what the other end held a frame for is no part of it."""
        self._is_same = is_same
        self._best: _Estimate | None = None
        self._before: _Estimate | None = None
        self._ends_at = 0

    def note(self, now: int, sent_at: int, echo: int, held: int) -> None:
        """A frame arrived `now` that the peer sent at `sent_at` of its own clock."""
        round_trip = now - echo - held
        if echo == 0 or held < 0 or round_trip < 0:
            return
        self.round_trip = round_trip
        if now >= self._ends_at:
            self._before, self._best, self._ends_at = self._best, None, now + _WINDOW
        if self._best is None or round_trip < self._best.round_trip:
            self._best = _Estimate(round_trip, sent_at + round_trip // 2 - now)

    @property
    def offset(self) -> int | None:
        """The offset, ns; None before the first round trip."""
        found = [each for each in (self._best, self._before) if each is not None]
        if not found:
            return None
        best = min(found)
        if self._is_same and abs(best.offset) <= best.round_trip // 2 + _SLACK:
            return 0
        return best.offset

    def age(self, now: int, instant: int) -> int | None:
        """Return how long ago an instant of the peer's clock was, ns; None before a round trip."""
        offset = self.offset
        return None if offset is None else max(now + offset - instant, 0)


_FORMER: Final = 256
"""How many former sessions of the other end are remembered."""
_SAY_WHAT_IS_MISSING: Final = (Kind.STEP, Kind.HEARTBEAT)


class Peer:
    """The other end of a link, as this one knows it.

    `own` is what this end says of itself; frames are accepted from an end that is cut likewise.
    `timeout` is for how long, ns, a peer may be silent, and how old a frame may be.
    """

    def __init__(self, session: int, own: Greeting, timeout: int) -> None:
        self.session = session
        self.own = own
        self.timeout = timeout
        self.greeting: Greeting | None = None
        """What the peer said of itself; None before there is one."""
        self.farewell: Farewell | None = None
        """What the peer said when it ended; None while it has not."""
        self.good_since: int | None = None
        """The instant from which on it was never silent; None while it is, or there is none."""
        self.silences = 0
        self.is_taken = False
        """Whether the other end has said lately that it has another peer."""
        self.wants_hello = False
        """Whether a hello is to be sent at once: a greeting came."""
        self.missing = NOTHING_MISSING
        """What this end may lack for longest, by the newest step or heartbeat of the peer."""
        self.session_of_peer = 0
        self.clock = PeerClock(is_same=False)
        self._window = Window()
        self._counter = 0
        self._said_at = 0
        """When the latest frame was sent, by this end's clock."""
        self._newest_at = 0
        """When the frame with the highest counter arrived."""
        self._bye = 0
        """The counter of the peer's bye; 0 while there is none."""
        self._candidate: tuple[int, Greeting] | None = None
        self._greeted: tuple[int, int] = (0, 0)
        self._former: deque[int] = deque(maxlen=_FORMER)

    # What arrives ---------------------------------------------------------------------------------

    def accept(self, frame: Frame, now: int) -> bool:
        """Take a frame that arrived; whether it is the peer's. Raises Refused.

        False: a greeting of an end that does not know our session yet.
        """
        if frame.session == self.session:
            raise Refused(Reason.REPLAYED, "a frame of this end itself")
        if frame.kind is Kind.HELLO:
            self._meet(frame, now)
            if frame.peer == 0 or (self.is_taken and frame.session != self.session_of_peer):
                return False
        if frame.peer != self.session:
            raise Refused(Reason.WRONG_SESSION, "meant for another session")
        if frame.session != self.session_of_peer:
            self._change_peer(frame, now)
        self._judge(frame, now)
        self._note(frame, now)
        return True

    def _meet(self, frame: Frame, now: int) -> None:
        """Note the peer that greets, if its greeting fits. Raises Refused."""
        greeting = greeting_of(frame.body)
        if greeting.digest != self.own.digest or set(greeting.leaving) & set(self.own.leaving):
            raise Refused(
                Reason.OTHER_CUT,
                f"role {greeting.role} of {greeting.board} sends and takes other ports than role "
                f"{self.own.role} of {self.own.board} takes and sends; expected the other end of "
                "one cut, with the same settings and versions",
            )
        if frame.session in self._former:
            raise Refused(Reason.WRONG_SESSION, "a former session")
        self.is_taken = greeting.is_taken and frame.peer == self.session
        if self.is_taken:
            return
        if frame.session != self.session_of_peer or frame.peer != self.session:
            self._candidate, self._greeted = (frame.session, greeting), (frame.sent_at, now)
            self.wants_hello = True

    def _change_peer(self, frame: Frame, now: int) -> None:
        """Let another session be the peer. Raises Refused."""
        if self._candidate is None or frame.session != self._candidate[0]:
            raise Refused(Reason.WRONG_SESSION, "from a session that has not greeted")
        if self.is_good(now):
            raise Refused(Reason.WRONG_SESSION, "the present peer is not silent")
        if not self._answers_now(frame, now):
            raise Refused(Reason.TOO_OLD, "an answer to nothing that was said lately")
        if self.session_of_peer != 0:
            self._former.append(self.session_of_peer)
        self.session_of_peer, self.greeting = self._candidate
        self._candidate = None
        self._compare_clocks(self.greeting)
        self._window, self._bye, self.missing = Window(), 0, NOTHING_MISSING
        self.wants_hello = True

    def _answers_now(self, frame: Frame, now: int) -> bool:
        """Return whether a frame answers what was said lately, so that it cannot be old itself."""
        return frame.echo != 0 and 0 <= now - frame.echo - max(frame.held, 0) <= 2 * self.timeout

    def _compare_clocks(self, greeting: Greeting) -> None:
        """Begin to compare the clocks: in a long silence they may have drifted apart."""
        self.clock = PeerClock(is_same=greeting.machine == self.own.machine != "")

    def _judge(self, frame: Frame, now: int) -> None:
        """Raise Refused unless a frame of the peer is new, of no sender that ended, and not old.

        A bye is never too old: an end that stood still meanwhile is to learn of it, too.
        """
        self._window.judge(frame.counter, frame.sent_at)
        if frame.counter < self._bye:
            raise Refused(Reason.STALE, "sent before a bye")
        if frame.kind is Kind.HELLO and not self.is_good(now) and self._answers_now(frame, now):
            self._compare_clocks(greeting_of(frame.body))
        age = self.clock.age(now, frame.sent_at)
        if age is not None and age > self.timeout and frame.kind is not Kind.BYE:
            raise Refused(Reason.TOO_OLD, f"sent {age / SECOND:.3f} s ago")

    def _note(self, frame: Frame, now: int) -> None:
        """A frame of the peer is accepted."""
        if self._window.accept(frame.counter, frame.sent_at):
            self._newest_at = now
            if frame.kind in _SAY_WHAT_IS_MISSING:
                self.missing = frame.missing
        self.clock.note(now, frame.sent_at, frame.echo, frame.held)
        if self.good_since is None:
            self.good_since = now
        self._said_at = max(self._said_at, now - (self.clock.age(now, frame.sent_at) or 0))
        self.farewell, self._bye = None, 0
        if frame.kind is Kind.BYE:
            self.farewell = farewell_of(frame.body)
            self._bye = frame.counter
            self.good_since = None

    # How it stands --------------------------------------------------------------------------------

    @property
    def silent_at(self) -> int:
        """The instant at which the peer counts as silent, unless it says something before."""
        return self._said_at + self.timeout

    def is_good(self, now: int) -> bool:
        """Return whether the peer said something within the timeout; notes a silence."""
        if self.good_since is not None and now >= self.silent_at:
            self.good_since = None
            self.silences += 1
        return self.good_since is not None

    def why_bad(self, now: int) -> str | None:
        """Return why the link is not good, in a few words; None if it is."""
        if self.is_good(now):
            return None
        if self.is_taken:
            return "the other end has another peer already"
        if self.greeting is None:
            return "the other end has not answered yet"
        if self.farewell is not None:
            return f"the {self.greeting.role} has ended: {self.farewell.reason}"
        silent_s = (now - self._said_at) / SECOND
        return f"the {self.greeting.role} has been silent for {silent_s:.1f} s"

    def interrupt(self) -> None:
        """Take the link for bad: it has to be good again for as long as at first."""
        self.good_since = None

    # What is sent ---------------------------------------------------------------------------------

    def frame(self, kind: Kind, now: int, body: bytes = b"") -> Frame:
        """The next frame to the peer."""
        self._counter += 1
        window = self._window
        echo, held = (window.sent_at, now - self._newest_at) if window.highest > 0 else (0, 0)
        return Frame(
            kind,
            self.session,
            self.session_of_peer,
            self._counter,
            now,
            echo,
            held,
            window.highest,
            window.shown,
            body=body,
        )

    def hello(self, now: int) -> Frame:
        """A greeting: the answer to one that came, else to a peer that is there, or to any end."""
        is_answer, self.wants_hello = self.wants_hello, False
        plain = self.frame(Kind.HELLO, now, encode(self.own))
        if self._candidate is None or not is_answer:
            return plain if self.is_good(now) else plain._replace(peer=0)
        sent_at, arrived_at = self._greeted
        if self._candidate[0] != self.session_of_peer and self.is_good(now):
            plain = plain._replace(body=encode(replace(self.own, is_taken=True)))
        return plain._replace(
            peer=self._candidate[0], echo=sent_at, held=now - arrived_at, seen=0, seen_before=0
        )

    def bye(self, now: int, farewell: Farewell) -> Frame:
        """The last frame: this end ends."""
        return self.frame(Kind.BYE, now, encode(farewell))
