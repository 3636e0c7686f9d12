"""Figures of curves over time: of a step response, and of what stands still while pushed.

Rise time: from 10 % to 90 % of the step. Overshoot: how far beyond the end it went, as a share of
the step. Settling time: from the step until it stays within 5 % of the step about its end.

Something is stuck while its measured rate, either way, stays within a threshold, which is above the
noise of the sensor, for long enough.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from math import sqrt
from statistics import StatisticsError, linear_regression
from typing import Final, TypeAlias

from msgspec import Struct

Points: TypeAlias = Sequence[tuple[float, float]]
"""Seconds, and the value; in order."""

SETTLED: Final = 0.05
"""Within this share of the step about its end."""
_LOW, _HIGH = 0.1, 0.9


class StepResponse(Struct, frozen=True):
    """Times in s; None for what did not happen while it was watched."""

    rise_s: float | None
    overshoot: float | None
    settling_s: float | None
    final: float | None
    samples: int


class Difference(Struct, frozen=True):
    """Distance of one response from another, in the unit of both."""

    rms: float
    largest: float


def step_response(points: Points, begin: float, end: float) -> StepResponse:
    """The figures of what came after the step; instants below 0 are left out.

    What was at the end or beyond when the step came did not rise to it, and went beyond by itself.
    """
    shares = [(at, (value - begin) / (end - begin)) for at, value in points if at >= 0]
    if not shares:
        return StepResponse(None, None, None, None, 0)
    was_there = shares[0][1] >= _HIGH
    low, high = (None, None) if was_there else (_reached(shares, _LOW), _reached(shares, _HIGH))
    farthest = max(share for _, share in shares)
    return StepResponse(
        rise_s=None if low is None or high is None else high - low,
        overshoot=max(farthest - 1.0, 0.0) if high is not None else None,
        settling_s=_settled_at(shares),
        final=points[-1][1],
        samples=len(shares),
    )


def difference(points: Points, other: Points) -> Difference | None:
    """Return how far the points are from the other curve, where both are; else None."""
    apart = [
        value - expected
        for at, value in points
        if at >= 0 and (expected := value_at(other, at)) is not None
    ]
    if not apart:
        return None
    rms = sqrt(sum(each * each for each in apart) / len(apart))
    return Difference(rms, max(map(abs, apart)))


def value_at(points: Points, at: float) -> float | None:
    """The value at an instant, on the line between its neighbours; None beyond either end."""
    after = bisect_left(points, at, key=lambda point: point[0])
    if after == len(points):
        return None
    if points[after][0] == at:
        return points[after][1]
    if after == 0:
        return None
    (begin, low), (end, high) = points[after - 1], points[after]
    return low + (high - low) * (at - begin) / (end - begin)


def _reached(shares: Points, level: float) -> float | None:
    """Find when a share was reached first, on the line between two samples."""
    before: tuple[float, float] | None = None
    for at, share in shares:
        if share >= level:
            if before is None:
                return at
            return before[0] + (at - before[0]) * (level - before[1]) / (share - before[1])
        before = at, share
    return None


def _settled_at(shares: Points) -> float | None:
    """From when on it stayed near its end; None if it did not at the last."""
    settled: float | None = None
    for at, share in shares:
        if abs(share - 1.0) > SETTLED:
            settled = None
        elif settled is None:
            settled = at
    return settled


class Stuck(Struct, frozen=True):
    """One interval, s; `is_released` is false for one that lasted to the end of the data."""

    from_s: float
    until_s: float
    is_released: bool

    @property
    def for_s(self) -> float:
        """Length, s, as far as was watched."""
        return self.until_s - self.from_s


def first_motion_s(rates: Points, threshold: float) -> float | None:
    """Find when it first moved faster than the threshold; None if it never did."""
    return next((at for at, rate in rates if abs(rate) > threshold), None)


def stuck_intervals(rates: Points, threshold: float, least_s: float) -> list[Stuck]:
    """Find where it stood still after it had moved, in order."""
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
    """Slope per second of the straight line nearest to the points; None for under two instants."""
    try:
        return linear_regression(*zip(*points, strict=True)).slope
    except (StatisticsError, TypeError):
        return None


def value_near(points: Points, at: float) -> float:
    """The last value at or before an instant, or the first one. Raises ValueError without any."""
    if not points:
        raise ValueError("no points; expected one or more")
    before = bisect_right(points, at, key=lambda point: point[0])
    return points[max(before - 1, 0)][1]
