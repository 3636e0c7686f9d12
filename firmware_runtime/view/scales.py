"""Scales of charts: from a value to its place on an axis, and round marks on it."""

from math import ceil, floor, log10
from typing import NamedTuple


class Axis(NamedTuple):
    """Values from `low` to `high` along the pixels from `begin` to `end`."""

    low: float
    high: float
    begin: float
    end: float

    def pixel(self, value: float) -> float:
        """Return where a value is."""
        return self.begin + (value - self.low) / (self.high - self.low) * (self.end - self.begin)

    def length(self, span: float) -> float:
        """Return how many pixels a span takes."""
        return abs(self.pixel(span) - self.pixel(0.0))

    def ticks(self, least_apart: float) -> list[float]:
        """Round values, 1, 2 or 5 times a power of ten apart, so many pixels or more."""
        least = least_apart / self.length(1.0)
        power = 10.0 ** floor(log10(least))
        step = next(power * n for n in (1, 2, 5, 10) if power * n >= least * 0.999)
        first, last = ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9)
        return [n * step for n in range(first, last + 1)]
