"""Rates: how often a robot uses its buses, and devices that are not at fault.

A healthy one uses a bus as often as its board states (`loads`); whatever fails, a driven one uses
other devices as often as a healthy one. Uses of devices are counted over 0.3 s: a busy line
remembers no more.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import accumulate
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.budget import BusLoad
from firmware_runtime.hal.strike import (
    HOLD_UP_A_LINE,
    KINDS,
    OF_NO_DEVICE,
    Breakable,
    Place,
    Strike,
    Use,
)
from firmware_runtime.lab.campaign.watched import EVERY

SPAN: Final = 300 * MILLISECOND
_LOOKS: Final = SPAN // EVERY
_PACE_LOOKS: Final = SECOND // EVERY
_PACE: Final = 0.15
"""Share by which a bus may be used more, or less, often than its board states."""


def off_pace(
    loads: Mapping[str, BusLoad], uses: Iterable[tuple[str, Use]], is_on: Sequence[bool]
) -> tuple[str, str] | None:
    """Return a bus that a driven robot never uses as often as its board states, and a sentence.

    Or one that it always uses more often. Of seconds with outputs on at each look; None where there
    is none.
    """
    begins = _begins(is_on, _PACE_LOOKS)
    counted = Counter((line, use.at // EVERY) for line, use in uses)
    for name, load in loads.items() if begins else ():
        stated = sum(SECOND / each.period_ns for each in load.transactions)
        sums = [0, *accumulate(counted[name, k] for k in range(len(is_on)))]
        seconds = [sums[k + _PACE_LOOKS] - sums[k] for k in begins]
        off = max(1.0, _PACE * stated)
        if max(seconds) < stated - off:
            found = f"{max(seconds)} transactions a second at the most"
        elif stated and min(seconds) > stated + off:
            found = f"{min(seconds)} transactions a second at the least"
        else:
            continue
        return name, f"it has {found}, and {stated:.0f} by its board's loads"
    return None


def least_uses(
    places: Iterable[Place], uses: Iterable[tuple[str, Use]], is_on: Sequence[bool]
) -> dict[str, int]:
    """Return how often each device was used, at the least, in a span with outputs on at each look.

    `uses` has those of each line, by its name. Empty where outputs were never on for so long.
    """
    begins = _begins(is_on, _LOOKS)
    counted = Counter((line, use.address, use.at // EVERY) for line, use in uses)
    least = {}
    for place in _devices(places) if begins else ():
        by_look = (counted[place.line, place.address, k] for k in range(len(is_on)))
        sums = [0, *accumulate(by_look)]
        least[place.name] = min(sums[k + _LOOKS] - sums[k] for k in begins)
    return least


def slowed(
    places: Iterable[Place], lines: Mapping[str, Breakable], at: int, least: Mapping[str, int]
) -> str | None:
    """Return a sentence about a device that was used less than half as often until an instant.

    `least` has how often it is used in the span when all is well.
    """
    counts = {name: _counted(line, at) for name, line in lines.items()}
    for place in _devices(places):
        count, expected = counts[place.line], least.get(place.name, 0)
        if count is not None and 2 * count[place.address] < expected:
            times = f"{count[place.address]} times in {SPAN // MILLISECOND} ms"
            return f"{place.name} was used {times}, {expected} at the least when all is well"
    return None


def kept_from(strikes: Iterable[Strike], places: Collection[Place]) -> Iterator[str]:
    """Yield the devices that faults may keep from being used: all on a line that is held up."""
    for each in strikes:
        lines = {place.line for place in places if place.name == each.device}
        is_of_all = not each.device and KINDS[each.kind].of not in OF_NO_DEVICE
        for place in places:
            is_held_up = each.kind in HOLD_UP_A_LINE and place.line in lines
            if is_of_all or is_held_up or place.name == each.device:
                yield place.name


def _begins(is_on: Sequence[bool], looks: int) -> list[int]:
    """Return the looks from which on outputs are on for so many."""
    on = [0, *accumulate(is_on)]
    return [k for k in range(len(on) - looks) if on[k + looks] - on[k] == looks]


def _devices(places: Iterable[Place]) -> Iterator[Place]:
    return (place for place in places if not place.is_line)


def _counted(line: Breakable, at: int) -> Counter[int | None] | None:
    """Count the uses in the span by address; None where the line does not remember all of it."""
    count: Counter[int | None] = Counter()
    for use in line.uses():
        if use.at <= at - SPAN:
            return count
        count[use.address] += use.at <= at
    return None
