"""A speed on its way to a target in equal steps, and how far it has turned: exact at any instant.

Nothing is kept up to date: speed and turn are formulas in integers, so it does not matter how
often, or after how long a silence, they are read.
"""

from dataclasses import dataclass

from firmware_runtime.devs.time import NEVER


@dataclass(frozen=True, slots=True)
class Ramp:
    """A speed from instant `since` on: `start`, then a step at `first_at` and after each `period`.

    Speeds are whole numbers in a unit of the chip's; `step` is 1 or more, the last one may be less.
    `turned_before` is the turn up to `since`; instants before that are not valid.
    """

    since: int
    start: int = 0
    target: int = 0
    step: int = 1
    first_at: int = NEVER
    period: int = 1
    turned_before: int = 0

    def speed(self, at: int) -> int:
        """Return the speed at an instant; a step due at that instant is done."""
        return self._speed_after(self._steps(at))

    def turned(self, at: int) -> int:
        """Return the integral of the speed up to `at`, in units times ns."""
        steps = self._steps(at)
        if steps == 0:
            return self.turned_before + self.start * (at - self.since)
        change = self.step if self.target > self.start else -self.step
        waiting = self.start * (self.first_at - self.since)
        plateaus = (steps - 1) * self.start + change * (steps - 1) * steps // 2
        last_step_at = self.first_at + (steps - 1) * self.period
        last = self._speed_after(steps) * (at - last_step_at)
        return self.turned_before + waiting + plateaus * self.period + last

    def next_step_at(self, at: int) -> int:
        """Return the first instant after `at` at which the speed changes."""
        if self.speed(at) == self.target:
            return NEVER
        return self.first_at + self._steps(at) * self.period

    def towards(self, at: int, target: int, step: int, period: int) -> "Ramp":
        """Return the ramp that takes over at `at`; itself if that would change nothing.

        The next step of a ramp under way comes when it would have come. With a period of 0 the
        speed is at its target at once.
        """
        same_steps = (step, period) == (self.step, self.period)
        if target == self.target and (same_steps or self.speed(at) == target):
            return self
        if period == 0:
            return Ramp(at, target, target, turned_before=self.turned(at))
        first_at = self.next_step_at(at)
        if first_at == NEVER:
            first_at = at + period
        return Ramp(at, self.speed(at), target, step, first_at, period, self.turned(at))

    def _steps(self, at: int) -> int:
        """Return how many steps are done at an instant."""
        if at < self.first_at:
            return 0
        needed = -(-abs(self.target - self.start) // self.step)
        return min(needed, (at - self.first_at) // self.period + 1)

    def _speed_after(self, steps: int) -> int:
        moved = min(steps * self.step, abs(self.target - self.start))
        return self.start + moved if self.target > self.start else self.start - moved
