"""Encoders against commands: a motor that does not turn as its driver was told.

The driver chip's registers read as they were written, whatever the motor does; only what the wheel
has turned contradicts them. Compared is what each wheel has turned since the last report with what
its speed makes of the time since then. A wheel that a ramp still brings up to speed may have turned
less, one with another load a third less; several times as much, or the other way, it cannot.

One report that says too little may be of a loop that was held up: two in a row are wrong. Reports
that come in quick succession, with as many commands, are taken together: each alone has few counts.
"""

import math
from typing import NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import Implausible, Runaway

COUNTS = 1 << 32
"""An encoder's counter begins again after so many."""
SLACK_COUNTS = 4.0
"""Counts that a report may be off: what stands still may be moved a little."""
SHOWN_COUNTS = 2 * SLACK_COUNTS
"""Counts in which half as much as told is told from all of it."""
LEAST_SHARE = 0.7
MOST_SHARE = 4.0
REPORTS = 2
LEAST_SPAN = SECOND // 5
"""Ns of reports that are judged together, at least."""


class _Told(NamedTuple):
    """What a wheel was told in a span of time, as counts."""

    span: int = 0
    ahead: float = 0.0
    back: float = 0.0
    ramp: float = 0.0
    """What a ramp explains, either way."""

    def mirrored(self) -> "_Told":
        """Return the same of a wheel that counts the other way."""
        return self._replace(ahead=self.back, back=self.ahead)

    @property
    def most(self) -> float:
        """Return the most that it may turn ahead."""
        return MOST_SHARE * self.ahead + self.ramp + SLACK_COUNTS

    @property
    def least(self) -> float:
        """Return the least that it has to turn ahead."""
        return LEAST_SHARE * self.ahead - MOST_SHARE * self.back - self.ramp - SLACK_COUNTS

    def is_shown(self, turned: float) -> bool:
        """Return whether it turned ahead as told, and far enough that no slack explains it."""
        due = self.ahead - self.back
        return due >= SHOWN_COUNTS and turned >= LEAST_SHARE * due

    def is_exceeded(self, turned: float) -> bool:
        """Return whether it turned more than told, or the other way, once that can be judged."""
        return self.span >= LEAST_SPAN and not -self.mirrored().most <= turned <= self.most


class WheelCheck:
    """One wheel: what it turned, report by report; `full_counts_s` is at full speed.

    `ramp` is how long a motor takes from rest to full speed, ns.
    """

    def __init__(self, where: str, name: str, full_counts_s: float, ramp: int) -> None:
        self._where, self._name = where, name
        self._full, self._ramp = full_counts_s, ramp
        self.agrees = True
        """Whether it has turned as told since it did not."""
        self._reached = 0.0
        """The speed that the ramp has reached by the last report; a stop is a ramp, too."""
        self.begin_again()

    def begin_again(self) -> None:
        """Forget what came before: the chip was stopped, or is not the same any more."""
        self._last: int | None = None
        self._speed = 0.0
        self._told = _Told()
        self._too_little = 0

    def is_unasked(self, count: int, elapsed: int) -> bool:
        """Return whether it turned, `elapsed` ns after the last, more than told or the other way.

        What reads so may be no turn: a wrong byte leaps, and the right one after it leaps back.
        """
        told, turned = self._judged(count, elapsed)
        return told.is_exceeded(turned)

    def take(self, count: int, elapsed: int, speed: float) -> None:
        """Take its encoder, `elapsed` ns after the last one, and the speed that it has from now on.

        Raises Implausible where it did not turn as it was told before: Runaway for more than that,
        or the other way.
        """
        told, turned = self._judged(count, elapsed)
        kind = Runaway if told.is_exceeded(turned) else Implausible
        if self._last is None:
            self._last = count
        else:
            most = elapsed / self._ramp if self._ramp else math.inf
            self._reached += max(-most, min(most, self._speed - self._reached))
        self._speed, self._told = speed, told
        if told.span < LEAST_SPAN:
            return
        self._last, self._told = count, _Told()
        if told.back > told.ahead:
            told, turned = told.mirrored(), -turned
        self._too_little = self._too_little + 1 if turned < told.least else 0
        if turned <= told.most and self._too_little < REPORTS:
            self.agrees |= told.is_shown(turned)
            return
        self.begin_again()
        self.agrees = False
        due = told.ahead - told.back
        expected = f"about {due:.0f} counts of its encoder in {told.span / SECOND:.2f} s"
        raise kind(self._where, f"{self._name} wheel's turn", turned, expected)

    def _judged(self, count: int, elapsed: int) -> tuple[_Told, float]:
        """Return what it was told and what it turned since the report that was judged last.

        Nothing where there was no report before.
        """
        if self._last is None:
            return _Told(), 0.0
        due = self._full * self._speed * elapsed / SECOND
        ramped = abs(self._speed - self._reached)
        ramp = self._full * ramped * min(ramped * self._ramp, elapsed) / SECOND
        before = self._told
        told = _Told(
            before.span + elapsed,
            before.ahead + max(due, 0.0),
            before.back + max(-due, 0.0),
            before.ramp + ramp,
        )
        return told, float((count - self._last + COUNTS // 2) % COUNTS - COUNTS // 2)
