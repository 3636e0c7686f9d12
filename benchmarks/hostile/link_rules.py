"""What a link refuses, by docs/wire.md, in words of its own: the reference of the sweep.

The reference knows how far the peer's clock is ahead, which the link has to estimate; so no attack
is as old as the limit to a few milliseconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from benchmarks.hostile.frames import (
    BAD_BYES,
    BAD_MOTIONS,
    BAD_YAWS,
    BYE,
    HELLO,
    MOTIONS,
    REPORT,
    VALUE,
    YAWS,
    Fields,
    fields_of,
    tag,
)
from benchmarks.hostile.sweep import ACCEPTED, NO_VALUE

MS: Final = 1_000_000
PORTS: Final[dict[int, tuple[Mapping[bytes, object], Mapping[bytes, str]]]] = {
    0: (MOTIONS, BAD_MOTIONS),
    1: (YAWS, BAD_YAWS),
}
"""Bodies by port: those that are taken with their values, those that are not with the reason."""


@dataclass
class Received:
    """The counters of one session that were let through."""

    highest: int = 0
    sent_at: int = 0
    counters: set[int] = field(default_factory=set)

    def fault(self, fields: Fields) -> str:
        """Why a frame is not the next; empty if it is."""
        if fields.counter > self.highest:
            return ""
        if fields.sent_at > self.sent_at:
            return "went_back"
        is_known = fields.counter in self.counters and self.highest - fields.counter <= 64
        return "replayed" if is_known else "stale"

    def note(self, fields: Fields) -> None:
        """It is let through."""
        self.highest, self.sent_at = fields.counter, fields.sent_at
        self.counters.add(fields.counter)


@dataclass
class LinkRules:
    """The receiving end: its carrier's rules first, then its run's."""

    session: int
    hellos: dict[bytes, str]
    """Bodies of hellos, and why they are refused; empty if they fit."""
    timeout: int
    clock_ahead: int = 0
    """Of the honest peer's clock, ns."""
    values: list[tuple[int, object]] = field(default_factory=list)
    _carried: dict[int, Received] = field(default_factory=dict)
    _greeted_at: int = -1 << 62
    _peer: int = 0
    _former: set[int] = field(default_factory=set)
    _candidate: int = 0
    _received: Received = field(default_factory=Received)
    _received_at: int | None = None
    """When the last frame of the peer came; None while the link is bad."""
    _sequences: dict[int, int] = field(default_factory=dict)

    def verdict(self, datagram: bytes, now: int) -> str:
        """What is to become of a datagram."""
        if len(datagram) > 8192:
            return "oversized"
        plain, said_tag = datagram[:-32], datagram[-32:]
        if tag(plain) != said_tag:
            return "forged"
        fields = fields_of(plain)
        if fields is None or fields.kind == REPORT:
            return "malformed"
        return self._carrier(fields, now) or self._run(fields, now)

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

    def _run(self, fields: Fields, now: int) -> str:  # noqa: PLR0911 -- a rule, a return
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
        if self._age(fields.sent_at, now) > self.timeout:
            return "too_old"
        self._received.note(fields)
        self._received_at = now
        if fields.kind == BYE:
            self._received_at = None if fields.body not in BAD_BYES else now
            return "malformed" if fields.body in BAD_BYES else NO_VALUE
        return self._value(fields, now) if fields.kind == VALUE else NO_VALUE

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
        self._received, self._received_at, self._sequences = Received(), None, {}
        return ""

    def _value(self, fields: Fields, now: int) -> str:
        if fields.port not in PORTS:
            return "unknown_port"
        good, bad = PORTS[fields.port]
        if fields.sequence <= self._sequences.get(fields.port, 0):
            return NO_VALUE
        if self._age(fields.origin, now) > self.timeout:
            self._received_at = None
            return "too_old"
        if fields.body not in good:
            return bad[fields.body]
        self._sequences[fields.port] = fields.sequence
        self.values.append((fields.port, good[fields.body]))
        return ACCEPTED

    def _age(self, instant: int, now: int) -> int:
        return now + self.clock_ahead - instant
