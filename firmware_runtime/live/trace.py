"""Numbers and states over the time of a run, kept within a bound and thinned honestly."""

from array import array
from bisect import bisect_left, bisect_right
from typing import Final, NamedTuple

from firmware_runtime.view.thinning import thinned

ROOM: Final = 40_000
"""Points of one trace; then the older half is thinned to a quarter."""
THINNED_BY: Final = 8
"""Points of which the least and the greatest are kept."""
STAYS: Final = 4_000
"""States of one model that are kept."""


class Points(NamedTuple):
    """Instants, s, and values."""

    times: list[float]
    values: list[float | None]


class Trace:
    """One number over time; where there are too many points no peak is lost."""

    def __init__(self) -> None:
        self._times = array("d")
        self._values = array("d")

    def add(self, at_s: float, value: float) -> None:
        """Append a point, not before the last."""
        self._times.append(at_s)
        self._values.append(value)
        if len(self._times) > ROOM:
            half = ROOM // 2
            times, values = thinned(self._times[:half], self._values[:half], half // THINNED_BY * 2)
            self._times = array("d", times) + self._times[half:]
            self._values = array("d", values) + self._values[half:]

    def since(self, at_s: float, most: int) -> Points:
        """Return what came after an instant, in so many points at most."""
        return self._part(bisect_right(self._times, at_s), len(self._times), most)

    def between(self, begin_s: float, end_s: float, most: int) -> Points:
        """Return the points of a stretch, and one on either side, so many at most."""
        first = max(bisect_left(self._times, begin_s) - 1, 0)
        last = min(bisect_right(self._times, end_s) + 1, len(self._times))
        return self._part(first, last, most)

    def _part(self, first: int, last: int, most: int) -> Points:
        times, values = thinned(self._times[first:last], self._values[first:last], most)
        finite = (each if each - each == 0.0 else None for each in values)
        return Points(list(times), list(finite))


class States:
    """What a model, or a port with words, was in, one after the other: the newest ones."""

    def __init__(self) -> None:
        self.entries: list[tuple[float, str]] = []
        """Instants, s, from which on it was in a state."""

    def enter(self, at_s: float, state: str) -> bool:
        """Note that it is in a state; return whether that is another one."""
        if self.entries and self.entries[-1][1] == state:
            return False
        self.entries.append((at_s, state))
        if len(self.entries) > STAYS:
            del self.entries[: STAYS // 4]
        return True

    def since(self, at_s: float) -> list[tuple[float, str]]:
        """Return the entries after an instant."""
        return self.entries[bisect_right(self.entries, at_s, key=lambda entry: entry[0]) :]

    def between(self, begin_s: float, end_s: float) -> list[tuple[float, str]]:
        """Return the entries of a stretch, and what it was in at its beginning."""
        first = bisect_right(self.entries, begin_s, key=lambda entry: entry[0]) - 1
        return [each for each in self.entries[max(first, 0) :] if each[0] <= end_s]
