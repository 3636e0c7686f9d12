"""Encoders against commands: a motor that does not turn as its driver was told.

The driver chip's registers read as they were written, whatever the motor does; only what the wheel
has turned contradicts them. Compared is what each wheel has turned since the last report with what
its speed makes of the time since then. A wheel that a ramp still brings up to speed may have turned
less, one with another load a third less; several times as much, or the other way, it cannot.

One report that says too little may be of a loop that was held up: two in a row are wrong.
"""

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import Implausible

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
        self.begin_again()

    def begin_again(self) -> None:
        """Forget what came before: the chip was stopped, or is not the same any more."""
        self._last: int | None = None
        self._speed = self._speed_before = 0.0
        self._too_little = 0

    def take(self, count: int, elapsed: int, speed: float) -> None:
        """Take its encoder, `elapsed` ns after the last one, and the speed that it has from now on.

        Raises Implausible where it did not turn as it was told before.
        """
        last, self._last = self._last, count
        commanded, before = self._speed, self._speed_before
        self._speed_before, self._speed = commanded, speed
        if last is None:
            return
        turned = float(count - last)
        due = self._full * commanded * elapsed / SECOND
        ramped = abs(commanded - before)
        coming = self._full * ramped * min(ramped * self._ramp, elapsed) / SECOND
        if commanded < 0:
            turned, due = -turned, -due
        most = MOST_SHARE * due + coming + SLACK_COUNTS
        least = LEAST_SHARE * due - coming - SLACK_COUNTS
        self._too_little = self._too_little + 1 if turned < least else 0
        if turned <= most and self._too_little < REPORTS:
            return
        self.begin_again()
        expected = f"about {due:.0f} counts of its encoder in {elapsed / SECOND:.2f} s"
        raise Implausible(self._where, f"{self._name} wheel's turn", turned, expected)
