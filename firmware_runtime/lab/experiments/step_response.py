"""The figures of a step response, by their usual definitions.

Rise time: from 10 % to 90 % of the step. Overshoot: how far beyond the end it went, as a share of
the step. Settling time: from the step until it stays within 5 % of the step about its end.
"""

from bisect import bisect_left
from collections.abc import Sequence
from math import sqrt
from typing import Final, TypeAlias

from msgspec import Struct

Points: TypeAlias = Sequence[tuple[float, float]]
"""Seconds since the step, and the value; in order."""

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
    """How far one response was from another, in the unit of both."""

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
    """How far the points are from the other curve, where both are; None where they never are."""
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
    """When a share was reached first, between two samples on the line between them."""
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
