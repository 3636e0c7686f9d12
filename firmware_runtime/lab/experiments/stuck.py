"""Where something stood still while it was pushed: found in its measured rate, by threshold.

It is stuck while the rate, either way, stays within `threshold` for `least_s` or longer. The
threshold is above the noise of the sensor; how slowly it may creep and count as stuck follows.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from msgspec import Struct

Points: TypeAlias = Sequence[tuple[float, float]]
"""Seconds, and a value; in order."""


class Stuck(Struct, frozen=True):
    """One interval, s; `is_released` is false for one that lasted to the end of the data."""

    from_s: float
    until_s: float
    is_released: bool

    @property
    def for_s(self) -> float:
        """How long it was stuck, as far as was watched."""
        return self.until_s - self.from_s


def first_motion_s(rates: Points, threshold: float) -> float | None:
    """When it first moved faster than the threshold; None if it never did."""
    return next((at for at, rate in rates if abs(rate) > threshold), None)


def stuck_intervals(rates: Points, threshold: float, least_s: float) -> list[Stuck]:
    """Where it stood still after it had moved, in order."""
    begin = first_motion_s(rates, threshold)
    if begin is None:
        return []
    after = [(at, rate) for at, rate in rates if at >= begin]
    return [each for each in _still(after, threshold) if each.for_s >= least_s]


def _still(rates: Points, threshold: float) -> Iterator[Stuck]:
    """Every stretch within the threshold, however short."""
    since: float | None = None
    for at, rate in rates:
        if abs(rate) > threshold:
            if since is not None:
                yield Stuck(since, at, is_released=True)
            since = None
        elif since is None:
            since = at
    if since is not None:
        yield Stuck(since, rates[-1][0], is_released=False)


def within(points: Points, from_s: float, until_s: float) -> list[tuple[float, float]]:
    """The points between two instants, both included."""
    return [(at, value) for at, value in points if from_s <= at <= until_s]


def slope(points: Points) -> float | None:
    """The slope of the straight line nearest to the points, by least squares, per second.

    None for fewer than two instants.
    """
    mean_at = sum(at for at, _ in points) / len(points) if points else 0.0
    spread = sum((at - mean_at) ** 2 for at, _ in points)
    if not spread:
        return None
    return sum((at - mean_at) * value for at, value in points) / spread


def value_near(points: Points, at: float) -> float:
    """The last value at or before an instant, or the first one. Raises ValueError without any."""
    if not points:
        raise ValueError("no points; expected one or more")
    before = bisect_right(points, at, key=lambda point: point[0])
    return points[max(before - 1, 0)][1]
