"""Scales of charts: from a value to its place on an axis, and round marks on it."""

from collections.abc import Callable, Iterable
from math import ceil, floor, log10
from typing import NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.number_formats import round_duration

_MOST_WORDS = 6
_MOST_STEPS = 6
_LEAST_COUNT = 0.6
"""A logarithmic axis of counts begins a little below one, so that one is to be seen."""
_MINUTE, _HOUR, _DAY = 60, 3_600, 86_400
_TIME_STEPS_S = (
    *(step / 1000 for step in (1, 2, 5, 10, 20, 50, 100, 200, 500)),
    *(step * unit for unit in (1, _MINUTE) for step in (1, 2, 5, 10, 15, 30)),
    *(step * _HOUR for step in (1, 2, 3, 6, 12, 24)),
)


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


class Tick(NamedTuple):
    """A mark on an axis: how far along it stands, from 0 to 1, and its text."""

    place: float
    text: str


class Scale:
    """An axis as wide as the page: places from 0 to 1; what is off it stands at its end."""

    def __init__(self, along: Callable[[float], float], marks: Iterable[tuple[float, str]]) -> None:
        self._along = along
        self.ticks = [Tick(self.place(value), text) for value, text in marks]

    def place(self, value: float) -> float:
        """Return how far along the axis a value lies."""
        return min(max(self._along(value), 0.0), 1.0)


def log_scale(values: Iterable[float]) -> Scale:
    """Whole decades of nanoseconds, wide enough for all values given."""
    shown = [max(value, 1.0) for value in values]
    low = floor(log10(min(shown)))
    high = max(ceil(log10(max(shown))), low + 1)
    marks = [(span, round_duration(span)) for span in (10**n for n in range(low, high + 1))]
    return Scale(lambda value: (log10(max(value, 1.0)) - low) / (high - low), _thinned(marks))


def count_scale(most: int) -> Scale:
    """Counts up to the most, logarithmic."""
    decades = log10(max(most, 2) / _LEAST_COUNT)
    powers = [10**n for n in range(floor(decades + log10(_LEAST_COUNT)) + 1)]
    return Scale(
        lambda value: log10(max(value, _LEAST_COUNT) / _LEAST_COUNT) / decades,
        _thinned([(power, f"{power:,}") for power in powers]),
    )


def share_scale(greatest: float) -> Scale:
    """Shares from nothing to a round number above the greatest, linear, with five marks."""
    steps = (step * 10**power for power in range(-4, 3) for step in (1, 2, 5))
    step = next((step for step in steps if 4 * step >= greatest), greatest)
    marks = [(number * step, f"{number * step * 100:g} %") for number in range(5)]
    return Scale(lambda value: value / (4 * step), marks)


def time_scale(begin: int, end: int) -> Scale:
    """Time of a run, linear, from one instant in ns to another, with six round marks at most."""
    span = max(end - begin, 1)
    step = next((s for s in _TIME_STEPS_S if _MOST_STEPS * s >= span / SECOND), _DAY)
    first, last = ceil(begin / SECOND / step), floor((begin + span) / SECOND / step)
    marks = [(n * step * SECOND, _time_text(n * step, step)) for n in range(first, last + 1)]
    return Scale(lambda value: (value - begin) / span, marks)


def _thinned(marks: list[tuple[float, str]]) -> list[tuple[float, str]]:
    """The same, without the words of some where there are too many to stand side by side."""
    every = -(-len(marks) // _MOST_WORDS)
    return [(value, "" if n % every else text) for n, (value, text) in enumerate(marks)]


def _time_text(seconds: float, step: float) -> str:
    for unit, name in ((_DAY, "d"), (_HOUR, "h"), (_MINUTE, "min")):
        if step >= unit:
            return f"{seconds / unit:g} {name}"
    return f"{seconds:.10g} s"
