"""Scales of a chart: from a value to its share of the way along an axis, and the marks on it."""

from collections.abc import Iterable
from math import ceil, floor, log10
from typing import NamedTuple, Protocol

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.number_formats import round_duration

_MOST_WORDS = 6
_MOST_STEPS = 6
_MINUTE, _HOUR, _DAY = 60, 3_600, 86_400
_TIME_STEPS_S = (
    *(step / 1000 for step in (1, 2, 5, 10, 20, 50, 100, 200, 500)),
    *(step * unit for unit in (1, _MINUTE) for step in (1, 2, 5, 10, 15, 30)),
    *(step * _HOUR for step in (1, 2, 3, 6, 12, 24)),
)


class Tick(NamedTuple):
    """A mark on an axis: how far along it stands, from 0 to 1, and what it says."""

    place: float
    text: str


class Scale(Protocol):
    """What a chart needs of an axis."""

    def place(self, value: float) -> float:
        """How far along the axis a value lies, from 0 to 1."""

    def ticks(self) -> list[Tick]:
        """The marks, in order."""


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


class LogScale:
    """A logarithmic axis over whole decades of nanoseconds, wide enough for all values given."""

    def __init__(self, values: Iterable[float]) -> None:
        shown = [max(value, 1.0) for value in values]
        self._low = floor(log10(min(shown)))
        self._high = max(ceil(log10(max(shown))), self._low + 1)

    def place(self, value: float) -> float:
        """How far along the axis; what is off it stands at its end."""
        along = (log10(max(value, 1.0)) - self._low) / (self._high - self._low)
        return min(max(along, 0.0), 1.0)

    def ticks(self) -> list[Tick]:
        """Powers of ten."""
        spans = [10**power for power in range(self._low, self._high + 1)]
        return _thinned([Tick(self.place(span), round_duration(span)) for span in spans])


class CountScale:
    """A logarithmic axis of counts that begins a little below one, so that one is to be seen."""

    _BEGIN = 0.6

    def __init__(self, most: int) -> None:
        self._decades = log10(max(most, 2) / self._BEGIN)

    def place(self, value: float) -> float:
        """How far along the axis."""
        return log10(max(value, self._BEGIN) / self._BEGIN) / self._decades

    def ticks(self) -> list[Tick]:
        """Powers of ten."""
        powers = range(floor(self._decades + log10(self._BEGIN)) + 1)
        return _thinned([Tick(self.place(10**power), f"{10**power:,}") for power in powers])


class ShareScale:
    """A linear axis of shares, from nothing to a round number above the greatest."""

    def __init__(self, greatest: float) -> None:
        steps = (step * 10**power for power in range(-4, 3) for step in (1, 2, 5))
        self._step = next((step for step in steps if 4 * step >= greatest), greatest)

    def place(self, value: float) -> float:
        """How far along the axis."""
        return min(value / (4 * self._step), 1.0)

    def ticks(self) -> list[Tick]:
        """Five, evenly."""
        return [Tick(number / 4, f"{number * self._step * 100:g} %") for number in range(5)]


class TimeScale:
    """The time of a run, linear, from one instant in ns to another."""

    def __init__(self, begin: int, end: int) -> None:
        self._begin = begin
        self._end = max(end, begin + 1)

    def place(self, value: float) -> float:
        """How far along the axis; what is off it stands at its end."""
        return min(max((value - self._begin) / (self._end - self._begin), 0.0), 1.0)

    def ticks(self) -> list[Tick]:
        """At round instants, six of them or fewer."""
        step = _time_step((self._end - self._begin) / SECOND)
        first = ceil(self._begin / SECOND / step)
        last = floor(self._end / SECOND / step)
        return [
            Tick(self.place(number * step * SECOND), _time_text(number * step, step))
            for number in range(first, last + 1)
        ]


def _thinned(ticks: list[Tick]) -> list[Tick]:
    """The same, without the words of some where there are too many to stand side by side."""
    every = -(-len(ticks) // _MOST_WORDS)
    return [
        tick if number % every == 0 else tick._replace(text="") for number, tick in enumerate(ticks)
    ]


def _time_step(span_s: float) -> float:
    """The least round step, in seconds, of which at most six fit into the span."""
    return next((step for step in _TIME_STEPS_S if _MOST_STEPS * step >= span_s), _DAY)


def _time_text(seconds: float, step: float) -> str:
    for unit, name in ((_DAY, "d"), (_HOUR, "h"), (_MINUTE, "min")):
        if step >= unit:
            return f"{seconds / unit:g} {name}"
    return f"{seconds:.10g} s"
