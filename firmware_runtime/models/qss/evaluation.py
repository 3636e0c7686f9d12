"""An expression over wires at an instant: its inputs then, and the sides of its conditions."""

from collections.abc import Mapping, Sequence
from math import inf, sqrt

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import format_time
from firmware_runtime.models.qss.program import Condition, Program
from firmware_runtime.models.qss.roots import falls_below_zero
from firmware_runtime.models.qss.segment import NANO, Segment

_INSTANT_S = 2e-9
"""A value that is, or was, zero within this time is at zero: events come at whole ns."""


class Wires:
    """The coefficients of several inputs one after another, as compiled code takes them."""

    def __init__(self, counts: Mapping[str, int], initial: Mapping[str, float]) -> None:
        self.flat: list[float] = []
        self.missing = {name for name in counts if name not in initial}
        self._places: dict[str, tuple[int, int]] = {}
        for name, count in counts.items():
            self._places[name] = (len(self.flat), count)
            self.flat += [float(initial.get(name, 0.0)), *[0.0] * (count - 1)]
        self._curved = [place for place in self._places.values() if place[1] > 1]

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        flat = self.flat
        for place, count in self._curved:
            if count == 2:
                flat[place] += seconds * flat[place + 1]
            elif count == 3:
                b, c = flat[place + 1], flat[place + 2]
                flat[place] += seconds * (b + seconds * c)
                flat[place + 1] = b + 2.0 * seconds * c
            else:
                flat[place : place + 4] = Segment(*flat[place : place + 4]).after(seconds)

    def put(self, block: Atomic, name: str, segment: Segment) -> None:
        """Take a segment that starts now. Raises ModelError for a degree that would be lost."""
        place, count = self._places[name]
        if count < 4 and segment[count] != 0.0:
            raise ModelError(
                f"{block.path}: input {name!r} received a segment of degree {count}; "
                f"expected {count} coefficients: give the block a higher order"
            )
        if count == 2:
            self.flat[place] = segment[0]
            self.flat[place + 1] = segment[1]
        else:
            self.flat[place : place + count] = segment[:count]
        if self.missing:
            self.missing.discard(name)

    def no_value(self, block: Atomic, expression: str, at: int, error: Exception) -> ModelError:
        """Where an expression has no value: at which instant, and of what."""
        return ModelError(
            f"{block.path}: {expression} has no value at {self.shown(at)}: {error}; "
            "expected finite real numbers all the way"
        )

    def shown(self, at: int) -> str:
        """An instant, and what was read there."""
        read = (f"{name} = {self.flat[k]:.6g}" for name, (k, _) in self._places.items())
        return ", ".join((format_time(at), *read))

    @property
    def are_moving(self) -> bool:
        """Whether any input changes between events."""
        return any(
            self.flat[place + k] != 0.0 for place, count in self._curved for k in range(1, count)
        )


def side_of(condition: Condition, g: Sequence[float]) -> bool:
    """On which side the condition's value is, or is about to be: its first derivative says that."""
    value, slope = g[0], g[1]
    if abs(value) > _INSTANT_S * abs(slope):
        return value > 0.0
    for each in (*g[1:], value):
        if each != 0.0:
            return each > 0.0
    return condition.at_zero


def leaves_side(condition: Condition, g: Sequence[float], longest_s: float, *, side: bool) -> float:
    """In how many seconds the value goes to the other side, or must be looked at again.

    A polynomial that is cut off is trusted only as far as the two terms left out move the root by
    less than a nanosecond.
    """
    a, b, c, d = g[0], g[1], g[2], g[3]
    if not side:
        a, b, c, d = -a, -b, -c, -d
    root = falls_below_zero(a, b, c, d)
    if condition.is_exact or root <= _INSTANT_S:
        return root
    left_out = abs(g[4]) + abs(g[5]) * min(root, longest_s)
    if b == 0.0 and c == 0.0 and d == 0.0 and left_out == 0.0:
        return inf
    if root < longest_s:
        slope = abs(b + root * (2.0 * c + 3.0 * d * root)) + 1e-300
        moved = left_out * root * root * root * root / slope
        if moved <= NANO:
            return root
        return root * (1.0 - min(sqrt(sqrt(NANO / moved)), 0.5))
    turns = sqrt(sqrt(abs(a) / left_out)) if left_out > 0.0 else longest_s
    return min(longest_s, max(turns, longest_s / 256.0))


def settle(
    conditions: Sequence[Condition],
    t: float,
    sides: list[bool],
    flat: Sequence[float],
    longest_s: float,
) -> float:
    """Bring the sides up to date, inner ones first; in how many seconds one must be looked at."""
    leaves = inf
    for number, condition in enumerate(conditions):
        g = condition.code(t, sides, flat)
        side = sides[number] = side_of(condition, g)
        leaves = min(leaves, leaves_side(condition, g, longest_s, side=side))
    return leaves


def worth(program: Program, t: float, flat: Sequence[float]) -> float:
    """The value at an instant, with the sides as they are then."""
    sides: list[bool] = []
    for condition in program.conditions:
        sides.append(side_of(condition, condition.code(t, sides, flat)))
    return program.value(t, sides, flat)[0]
