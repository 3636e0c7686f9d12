"""The order in which a campaign goes through its space: any beginning of it is a fair sample."""

from array import array
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import chain, count, cycle, islice
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.strike import KINDS, OF_NO_DEVICE, Kind
from firmware_runtime.lab.campaign.evenly import OTHER, spread
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.space import FIRST_BIT, Case, Space, is_of_a_bit
from firmware_runtime.lab.campaign.watched import EVERY

_RUNS_PER_SECOND: Final = 2
"""For one run of a whole mission so many others come for each of its seconds. Those that go on, and
faults again and again, take about a quarter of a campaign's time until each has been tried."""
_TURNS: Final = 4
"""For one of any other kind so many come of one that inverts a bit, or a byte, and of what people
do, which a robot meets every day."""
_AT_START: Final = 4
"""One in so many strikes before outputs are first on: what is measured or brought up once is so
then, in a short time of which an even sample has next to nothing."""
_AROUND: Final = range(-3, 1)
"""Looks before, and at, the one by which a state diagram has taken an arrow for the first time."""


def in_courses(space: Space, most: int | None = None) -> Iterator[int]:
    """Yield all numbers of a space, spread evenly, `most` faults and all pairs.

    Each kind of each device has as many as any other, as far as it has so many, but for bits, bytes
    and people: a sensor that is read often would leave next to none to a motor. Those of one are
    spread evenly over its transactions, but that one in four of a device strikes as the robot
    starts.
    Cases that are alike come together.
    """
    singles = space.pairs_from if most is None else min(most, space.pairs_from)
    pairs = len(space) - space.pairs_from
    done = 0
    for index, number in enumerate(islice(_with_series(space), singles), 1):
        yield number
        while done < pairs * index // singles:
            yield space.pairs_from + done
            done += 1


def others_per_mission(found: Healthy) -> int:
    """Return how many other runs there are for one of a whole mission."""
    return _RUNS_PER_SECOND * found.until // SECOND


def _with_series(space: Space) -> Iterator[int]:
    """Yield single faults, and now and then one that comes again and again.

    Failures come first: they are counted. Twice as often comes what people do as the robot's state
    changes.
    """
    others = others_per_mission(space.found)
    evenly = (space.singles + number for number in spread(space.pairs_from - space.singles))
    series = iter(sorted(evenly, key=lambda number: not _kind(space[number]).leaves_no_doubt))
    of_people = as_states_change(space)
    around = iter([of_people[place] for place in spread(len(of_people))])
    without = frozenset(of_people)
    for index, number in enumerate((each for each in _courses(space) if each not in without), 1):
        yield number
        if index % others == 0:
            yield from islice(series, 1)
        if index % (others // 2) == 0:
            yield from islice(around, 1)
    yield from chain(series, around)


@lru_cache(maxsize=4)
def as_states_change(space: Space) -> Sequence[int]:
    """Return the numbers of what people do, and soon end, around each arrow that healthy runs take.

    What a model of the robot keeps of a state that it has left shows by that alone.
    """
    taken = space.found.taken
    news = [look for look in range(1, len(taken)) if taken[look] - taken[look - 1]]
    looks = {look + aside for look in news for aside in _AROUND}
    shortest: dict[tuple[str, int], int] = {}
    by_people = (each for each in space.by_fault() if _kind(space[each[0]]).of == "people")
    for number in chain.from_iterable(by_people):
        case = space[number]
        strike, look = case.strikes[0], case.before // EVERY
        if look in looks:
            other = shortest.setdefault((strike.kind, look), number)
            if strike.span < space[other].strikes[0].span:
                shortest[strike.kind, look] = number
    return tuple(shortest.values())


def _courses(space: Space) -> Iterator[int]:
    seen = bytearray(space.singles)
    by_fault = space.by_fault()
    orders: list[Iterator[int]] = []
    often: list[Iterator[int]] = []
    for turn, place in enumerate(spread(len(by_fault))):
        numbers = by_fault[place]
        kind = _kind(space[numbers[0]])
        has_bits = is_of_a_bit(kind)
        is_even = has_bits or kind.of in OF_NO_DEVICE
        at_start = 0 if is_even else bisect_left(numbers, space.started)
        order = _order(numbers, at_start, FIRST_BIT if has_bits else place * OTHER, turn)
        for each in (orders, often) if has_bits or kind.of == "people" else (orders,):
            each.append(order)
    for course in cycle((orders, *[often] * (_TURNS - 1))):
        if not orders:
            return
        for order in tuple(course):
            first = next((number for number in order if not seen[number]), None)
            if first is None:
                for each in (orders, often):
                    if order in each:
                        each.remove(order)
                continue
            for number in space.alike(first):
                seen[number] = 1
                yield number


def _order(numbers: "array[int]", at_start: int, begin: int, turn: int) -> Iterator[int]:
    """Yield numbers, spread evenly, some twice; it is the turn of one of the first `at_start`."""
    evenly, starting = spread(len(numbers), begin), spread(at_start, begin)
    for index in count(turn):
        first = starting if index % _AT_START == 0 else ()
        place = next(chain(first, evenly), None)
        if place is None:
            return
        yield numbers[place]


def _kind(case: Case) -> Kind:
    """Return the kind of its first fault."""
    return KINDS[case.strikes[0].kind]
