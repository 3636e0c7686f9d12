"""Encoders against commands: a motor that does not turn as its driver was told.

The driver chip's registers read as they were written, whatever the motor does; only what the wheel
has turned contradicts them. Compared is what each wheel has turned since the last report with what
its speed makes of the time since then. A wheel that a ramp still brings up to speed may have turned
less, one with another load a third less; several times as much, or the other way, it cannot.

One report that says too little may be of a loop that was held up: two in a row are wrong.
"""

import math

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import Implausible, Runaway

COUNTS = 1 << 32
"""An encoder's counter begins again after so many."""
SLACK_COUNTS = 4.0
"""Counts that a report may be off: what stands still may be moved a little."""
LEAST_SHARE = 0.7
MOST_SHARE = 4.0
REPORTS = 2


class WheelCheck:
    """One wheel: what it turned, report by report; `full_counts_s` is at full speed.

    `ramp` is how long a motor takes from rest to full speed, ns.
    """

    def __init__(self, where: str, name: str, full_counts_s: float, ramp: int) -> None:
        self._where, self._name = where, name
        self._full, self._ramp = full_counts_s, ramp
        self._reached = 0.0
        """The speed that the ramp has reached by the last report; a stop is a ramp, too."""
        self.begin_again()

    def begin_again(self) -> None:
        """Forget what came before: the chip was stopped, or is not the same any more."""
        self._last: int | None = None
        self._speed = 0.0
        self._too_little = 0

    def is_unasked(self, count: int, elapsed: int) -> bool:
        """Return whether it turned, `elapsed` ns after the last, more than told or the other way.

        What reads so may be no turn: a wrong byte leaps, and the right one after it leaps back.
        """
        turned, due, coming = self._turned(count, elapsed)
        return not -coming - SLACK_COUNTS <= turned <= MOST_SHARE * due + coming + SLACK_COUNTS

    def take(self, count: int, elapsed: int, speed: float) -> None:
        """Take its encoder, `elapsed` ns after the last one, and the speed that it has from now on.

        Raises Implausible where it did not turn as it was told before: Runaway for more than that,
        or the other way.
        """
        turned, due, coming = self._turned(count, elapsed)
        is_ahead = turned > MOST_SHARE * due + coming + SLACK_COUNTS
        is_unasked = self.is_unasked(count, elapsed)
        if self._last is not None:
            most = elapsed / self._ramp if self._ramp else math.inf
            self._reached += max(-most, min(most, self._speed - self._reached))
        self._last, self._speed = count, speed
        least = LEAST_SHARE * due - coming - SLACK_COUNTS
        self._too_little = self._too_little + 1 if turned < least else 0
        if not is_ahead and self._too_little < REPORTS:
            return
        self.begin_again()
        kind = Runaway if is_unasked else Implausible
        expected = f"about {due:.0f} counts of its encoder in {elapsed / SECOND:.2f} s"
        raise kind(self._where, f"{self._name} wheel's turn", turned, expected)

    def _turned(self, count: int, elapsed: int) -> tuple[float, float, float]:
        """Return counts that it turned as it was told to, that were due, and that a ramp explains.

        None of all where there was no report before.
        """
        if self._last is None:
            return 0.0, 0.0, 0.0
        due = self._full * self._speed * elapsed / SECOND
        ramped = abs(self._speed - self._reached)
        coming = self._full * ramped * min(ramped * self._ramp, elapsed) / SECOND
        turned = float((count - self._last + COUNTS // 2) % COUNTS - COUNTS // 2)
        return (-turned, -due, coming) if self._speed < 0 else (turned, due, coming)
