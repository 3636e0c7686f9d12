"""What a link refuses, by docs/wire.md, in words of its own: the reference of the sweep.

The reference knows how far the peer's clock is ahead, which the link has to estimate; so no attack
is as old as the limit to a few milliseconds.
"""

from dataclasses import dataclass, field
from typing import Final

from tests.support.hostile.frames import (
    BAD_BYES,
    BYE,
    HEARTBEAT,
    HELLO,
    REPORT,
    STEP,
    Fields,
    fields_of,
    tag,
)
from tests.support.hostile.order_rules import OrderRules
from tests.support.hostile.sweep import ACCEPTED, NO_VALUE

MS: Final = 1_000_000


@dataclass
class Received:
    """The counters of one session that were let through."""

    highest: int = 0
    sent_at: int = 0
    counters: set[int] = field(default_factory=set)

    def fault(self, fields: Fields) -> str:
        """Why a frame is refused by counter and instant; empty if it is not."""
        behind, older = self.highest - fields.counter, self.sent_at - fields.sent_at
        if behind < 0:
            return "went_back" if self.highest and older > 0 else ""
        if older < 0:
            return "went_back"
        if behind > 1024:
            return "went_back" if older < 200 * MS else "stale"
        return "replayed" if fields.counter in self.counters else ""

    def note(self, fields: Fields) -> None:
        """It is let through."""
        if fields.counter > self.highest:
            self.highest, self.sent_at = fields.counter, fields.sent_at
        self.counters.add(fields.counter)


@dataclass
class LinkRules:
    """The receiving end: its carrier's rules first, then its run's."""

    session: int
    hellos: dict[bytes, str]
    """Bodies of hellos, and why they are refused; empty if they fit."""
    timeout: int
    ahead: dict[int, int] = field(default_factory=dict)
    """Of the honest peer's clock by its session, ns."""
    _carried: dict[int, Received] = field(default_factory=dict)
    _greeted_at: int = -1 << 62
    _peer: int = 0
    _former: set[int] = field(default_factory=set)
    _candidate: int = 0
    _received: Received = field(default_factory=Received)
    _received_at: int | None = None
    """When the last frame of the peer came; None while the link is bad."""
    _bye: int = 0
    """The counter of the peer's bye; 0 while there is none."""
    _missing: tuple[int, int, int] = (0, 0, 0)
    """Port, sequence and instant of what this end may lack."""

    def __post_init__(self) -> None:
        self.order = OrderRules(self.timeout)

    def verdict(self, datagram: bytes, now: int) -> str:
        """What is to become of a datagram; steps that have waited too long are given up with it."""
        entered = len(self.order.values)
        found = self._verdict(datagram, now)
        self.order.expire(self._clock(now))
        self.order.settle()
        if self.order.has_lost():
            self._received_at = None
        return ACCEPTED if found == NO_VALUE and len(self.order.values) > entered else found

    def _verdict(self, datagram: bytes, now: int) -> str:
        if len(datagram) > 8192:
            return "oversized"
        plain, said_tag = datagram[:-32], datagram[-32:]
        if tag(plain) != said_tag:
            return "forged"
        fields = fields_of(plain)
        if fields is None or fields.kind == REPORT:
            return "malformed"
        return self._carrier(fields, now) or self._run(fields, now)

    def lacks(self, now: int) -> bool:
        """Whether something that left the peer longer ago than the limit is missing here."""
        port, sequence, since = self._missing
        is_old = self._clock(now) - since >= self.timeout
        return is_old and sequence > self.order.newest(port)

    # The carrier ----------------------------------------------------------------------------------

    def _carrier(self, fields: Fields, now: int) -> str:
        if fields.session == self.session:
            return "replayed"
        if fields.peer not in (0, self.session):
            return "wrong_session"
        if fields.session not in self._carried:
            if fields.kind != HELLO or now - self._greeted_at < 5 * MS:
                return "wrong_session"
            self._greeted_at = now
            if len(self._carried) == 16:
                del self._carried[next(iter(self._carried))]
            self._carried[fields.session] = Received()
        received = self._carried[fields.session]
        fault = received.fault(fields)
        if fault in {"replayed", "stale"}:
            return fault
        if not fault:
            received.note(fields)
        self._carried[fields.session] = self._carried.pop(fields.session)
        return ""

    # The run --------------------------------------------------------------------------------------

    def _run(self, fields: Fields, now: int) -> str:  # noqa: C901, PLR0911 -- a rule, a return
        if fields.kind == HELLO:
            fault = self._hello(fields)
            if fault or fields.peer == 0:
                return fault or NO_VALUE
        if fields.peer != self.session:
            return "wrong_session"
        if fields.session != self._peer and (fault := self._new_peer(fields, now)):
            return fault
        if fault := self._received.fault(fields):
            if fault == "went_back":
                self._received_at = None
            return fault
        if fields.counter < self._bye:
            return "stale"
        if fields.kind != BYE and self._clock(now) - fields.sent_at > self.timeout:
            return "too_old"
        if fields.counter > self._received.highest and fields.kind in {STEP, HEARTBEAT}:
            self._missing = (fields.missing_port, fields.missing, fields.missing_since)
        self._received.note(fields)
        self._received_at = now
        self._bye = 0
        if fields.kind == BYE:
            if fields.body in BAD_BYES:
                return "malformed"
            self._received_at, self._bye = None, fields.counter
        return self._step(fields, now) if fields.kind == STEP else NO_VALUE

    def _hello(self, fields: Fields) -> str:
        fault = self.hellos[fields.body]
        if fault:
            return fault
        if fields.session in self._former:
            return "wrong_session"
        if fields.session != self._peer:
            self._candidate = fields.session
        return ""

    def _new_peer(self, fields: Fields, now: int) -> str:
        if fields.session != self._candidate:
            return "wrong_session"
        if self._received_at is not None and now - self._received_at < self.timeout:
            return "wrong_session"
        round_trip = now - fields.echo - max(fields.held, 0)
        if fields.echo == 0 or not 0 <= round_trip <= 2 * self.timeout:
            return "too_old"
        self._former |= {self._peer} - {0}
        self._peer, self._candidate = fields.session, 0
        self._received, self._received_at, self._bye = Received(), None, 0
        self._missing = (0, 0, 0)
        self.order.begin_again()
        return ""

    def _step(self, fields: Fields, now: int) -> str:
        fault = self.order.take(fields, self._clock(now))
        if fault == "too_old":
            self._received_at = None
        return fault or NO_VALUE

    def _clock(self, now: int) -> int:
        """What the peer's clock shows."""
        return now + self.ahead.get(self._peer, 0)
