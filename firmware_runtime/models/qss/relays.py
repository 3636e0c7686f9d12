"""Blocks with two states that change at zero crossings: hysteresis, switch, quantizer."""

from math import floor, inf

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.models.qss.finite import demand_finite
from firmware_runtime.models.qss.roots import falls_below_zero
from firmware_runtime.models.qss.segment import NANO, ZERO_SEGMENT, Segment, whole_after

_INSTANT_S = 2e-9


class Watching(Atomic):
    """Sends when its input reaches a level; subclasses say which levels and what."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", Segment)
        self.out = self.out_port("out", Segment)
        self._segment = ZERO_SEGMENT
        self._sends = False

    def output(self) -> None:
        """Send what holds now."""
        if self._sends:
            self.out.send(self._sent())

    def internal(self) -> None:
        """Wait for the next level, or see that it is reached."""
        if self._sends:
            self._sends = False
            self.sigma = whole_after(self._next_s())
        else:
            self._go_on(self.sigma * NANO)

    def external(self, elapsed: int) -> None:
        """Take a new segment in."""
        self._go_on(elapsed * NANO)

    def _go_on(self, seconds: float) -> None:
        if self.entrance:
            self._segment = self.entrance[-1]
        else:
            self._segment = self._segment.after(seconds)
        self._sends = self._update() or self._sends
        self.sigma = 0 if self._sends else whole_after(self._next_s())

    def _update(self) -> bool:
        """Change the state if a level is reached; return whether something is to be sent."""
        raise NotImplementedError

    def _sent(self) -> Segment:
        raise NotImplementedError

    def _next_s(self) -> float:
        raise NotImplementedError

    def _reaches(self, level: float, *, rising: bool) -> bool:
        """Whether the input is at a level, or beyond it, and not just about to come back."""
        beyond = self._segment[0] - level if rising else level - self._segment[0]
        speed = self._segment[1] if rising else -self._segment[1]
        if abs(beyond) > _INSTANT_S * abs(speed):
            return beyond > 0.0
        return speed >= 0.0

    def _until(self, level: float, *, rising: bool) -> float:
        """In how many seconds the input rises, or falls, through a level."""
        a, b, c, d = self._segment
        if rising:
            return falls_below_zero(level - a, -b, -c, -d)
        return falls_below_zero(a - level, b, c, d)


class Hysteresis(Watching):
    """On from where its input rises to `upper`, off from where it falls to `lower`.

    off --in reaches upper--> on --in reaches lower--> off; each sends `high` or `low` at `out`
    """

    def __init__(  # noqa: PLR0913 -- half of them have defaults
        self,
        name: str,
        lower: float,
        upper: float,
        *,
        low: float = 0.0,
        high: float = 1.0,
        is_on: bool = False,
    ) -> None:
        super().__init__(name)
        if not lower < upper:
            raise ModelError(f"{self.path}: lower is {lower}; expected less than upper, {upper}")
        self.lower, self.upper, self.low, self.high = lower, upper, low, high
        self.is_on = is_on
        self._is_first = True

    def _update(self) -> bool:
        is_first, self._is_first = self._is_first, False
        level = self.lower if self.is_on else self.upper
        if self._reaches(level, rising=not self.is_on):
            self.is_on = not self.is_on
            return True
        return is_first

    def _sent(self) -> Segment:
        return Segment(self.high if self.is_on else self.low)

    def _next_s(self) -> float:
        level = self.lower if self.is_on else self.upper
        return self._until(level, rising=not self.is_on)


class Quantizer(Watching):
    """The multiple of `step` below its input, or the nearest one.

    An input that stays at the edge of a step does not make it chatter: it goes back only `slack`
    times the step beyond the edge.
    """

    def __init__(
        self, name: str, step: float, *, nearest: bool = False, slack: float = 1e-6
    ) -> None:
        super().__init__(name)
        if not (0.0 < step < inf and 0.0 <= slack < 1.0):
            raise ModelError(f"{self.path}: step {step}, slack {slack}; expected step > 0 > -slack")
        self.step, self.slack = step, slack
        self._offset = 0.5 * step if nearest else 0.0
        self._number: int | None = None

    def _update(self) -> bool:
        if self._number is None or not self._is_within():
            value = (self._segment[0] + self._offset) / self.step
            rises = self._segment[1] >= 0.0
            near = round(value)
            is_at_edge = abs(value - near) * self.step <= _INSTANT_S * abs(self._segment[1])
            if is_at_edge:
                self._number = near if rises else near - 1
            else:
                self._number = floor(value)
            return True
        return False

    def _is_within(self) -> bool:
        lower, upper = self._edges()
        return not (self._reaches(upper, rising=True) or self._reaches(lower, rising=False))

    def _edges(self) -> tuple[float, float]:
        bottom = (self._number or 0) * self.step - self._offset
        return bottom - self.slack * self.step, bottom + self.step

    def _sent(self) -> Segment:
        return Segment((self._number or 0) * self.step)

    def _next_s(self) -> float:
        lower, upper = self._edges()
        return min(self._until(upper, rising=True), self._until(lower, rising=False))


class Switch(Watching):
    """`above` while the control input `in` is at or over the threshold, else `below`.

    The wire that is chosen goes through as it is, with all its events.
    """

    def __init__(self, name: str, threshold: float = 0.0) -> None:
        super().__init__(name)
        self.above = self.in_port("above", Segment)
        self.below = self.in_port("below", Segment)
        demand_finite(self.path, threshold=threshold)
        self.threshold = threshold
        self._is_above: bool | None = None
        self._passed = {True: ZERO_SEGMENT, False: ZERO_SEGMENT}

    def _go_on(self, seconds: float) -> None:
        has_new = False
        for side, port in ((True, self.above), (False, self.below)):
            if port:
                self._passed[side] = port[-1]
                has_new = has_new or side is self._is_above
            else:
                self._passed[side] = self._passed[side].after(seconds)
        self._sends = self._sends or has_new
        super()._go_on(seconds)

    def _update(self) -> bool:
        was = self._is_above
        if was is None:
            self._is_above = self._segment[0] >= self.threshold
        elif self._reaches(self.threshold, rising=not was):
            self._is_above = not was
        return self._is_above is not was

    def _sent(self) -> Segment:
        return self._passed[bool(self._is_above)]

    def _next_s(self) -> float:
        return self._until(self.threshold, rising=not self._is_above)
