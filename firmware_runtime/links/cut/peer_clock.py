"""The clock of the other end, estimated from what it echoes: round trip, offset, age.

Each frame carries the instant of the latest frame that its sender has accepted, and how long that
was held. So the time both ways is known by one clock; half of it is taken for the way here. The
estimate of the shortest round trip of the last seconds counts: it has least room for error.
"""

from typing import Final, NamedTuple

from firmware_runtime.devs.time import MILLISECOND, SECOND

_WINDOW: Final = 4 * SECOND
_SLACK: Final = MILLISECOND
"""Ns by which clocks that are one may seem to differ."""


class _Estimate(NamedTuple):
    round_trip: int
    offset: int


class PeerClock:
    """Offset of the peer's CLOCK_MONOTONIC: what it shows less what ours shows, ns.

    `is_same` says that both ends run on one machine: then the offset is none, as long as the
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
