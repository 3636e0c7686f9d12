"""The space of a campaign: every single fault at every use of the lines of a mission, and more.

A fault of a device strikes with a transaction of that device: one that is made between two of them
strikes the second one, and is the same run. So the space has each fault once for each use in which
it shows: what alters readings at those that read, what refuses a written byte at those that write.
Kinds that hold up a whole bus are tried on the bus, too; a push, a stall and being disarmed at each
use of the first line. A kind that has a number, such as which bit, has one that is spread evenly
over its uses, whatever their rhythm, and so is the way of a push.

A small fault that heals may come again and again, each time that it has: a count that is not reset,
or a budget that is used up, shows by that alone. Each such fault is in the space once.

Pairs are a sample: the first ones of any size are spread evenly over what the first fault is, and
over the faults within a second after it.
"""

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache
from itertools import accumulate
from typing import Final, NamedTuple, TypeAlias, overload

from msgspec import Struct

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.strike import (
    HOLD_UP_A_LINE,
    KINDS,
    LEAST_AGAIN,
    OF_NO_DEVICE,
    Kind,
    Place,
    Strike,
)
from firmware_runtime.lab.campaign.evenly import BITS, GOLDEN, OTHER, number_of, spread
from firmware_runtime.lab.campaign.healthy import AT_START, Healthy, UseOfLine, healthy
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.watched import EVERY

_FOR_A_WHILE_S: Final = 1.0
_DISARMED_S, _LONG_DISARMED_S = 3.0, 15.0
"""A while to an operator: longer than most drivers obey the last command, and than all do."""
_LONG_EACH: Final = 4
"""One in so many is disarmed for the longer while."""
PAIRED_WITHIN: Final = SECOND
_MOST_AGAIN: Final = 12
"""How often a fault comes, at most, that does so again and again."""
_BETWEEN: Final = 500 * MILLISECOND
"""Beside what its rig says that it takes to heal."""
FIRST_BIT: Final = OTHER
"""Where of a circle a sample of bits, and of bytes, begins; in its order they take turns."""
_STRIDE: Final = 13
"""From a bit, or byte, to that of the next fault in turn: eight of them are each of one byte."""


_Key: TypeAlias = tuple[str, int | None, bool, bool]


class Case(Struct, frozen=True):
    """One fault of the space, or more, and the last look before the step that it strikes in."""

    strikes: tuple[Strike, ...]
    before: int


class Form(NamedTuple):
    """A fault without its instant."""

    kind: Kind
    device: str
    for_s: float | None


class Space(Sequence[Case]):
    """All of them, in order of time, each made when it is asked for."""

    def __init__(self, found: Healthy) -> None:
        self.found = found
        self._first_line = found.uses[0].line if found.uses else ""
        self._by_use: dict[_Key, tuple[Form, ...]] = {}
        counts = (len(self._forms_at(each)) for each in found.uses)
        self._ends = list(accumulate(counts))
        self._use_times = [each.use.at for each in found.uses]
        self.singles = self._ends[-1] if self._ends else 0
        """Its faults that strike alone come first; then those that come again, then pairs."""

    def __len__(self) -> int:
        return self.pairs_from + (self.found.mission.pairs if self.singles > 1 else 0)

    @property
    def pairs_from(self) -> int:
        """The number of the first pair."""
        return self.singles + len(self._series)

    @overload
    def __getitem__(self, number: int) -> Case: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Case]: ...
    def __getitem__(self, number: int | slice) -> Case | Sequence[Case]:
        if isinstance(number, slice):
            return [self[each] for each in range(*number.indices(len(self)))]
        if not 0 <= number < len(self):
            raise IndexError(number)
        if number >= self.pairs_from:
            return self._pair(number - self.pairs_from)
        if number >= self.singles:
            return self._series[number - self.singles]
        place = bisect_right(self._ends, number)
        use = self.found.uses[place]
        form = self._forms_at(use)[number - (self._ends[place - 1] if place else 0)]
        return Case((self._strike(form, place),), use.before)

    def _strike(self, form: Form, place: int) -> Strike:
        """Return the fault of a form at the use with this number."""
        at_s, amount = self._use_times[place] / SECOND, self._amount(form.kind, place)
        for_s = form.for_s
        if for_s == _DISARMED_S and form.kind.of == "people" and number_of(place) % _LONG_EACH == 0:
            for_s = _LONG_DISARMED_S
        return Strike(form.kind.name, form.device, at_s, for_s, amount)

    @cached_property
    def _series(self) -> Sequence[Case]:
        """Small faults that come again and again."""
        uses, by_key = self.found.uses, dict[_Key, list[int]]()
        for place, use in enumerate(uses):
            by_key.setdefault(_key(use), []).append(place)
        shown: dict[Form, list[list[int]]] = {}
        for places in by_key.values():
            for form in filter(_is_small, self._forms_at(uses[places[0]])):
                shown.setdefault(form, []).append(places)
        series = (self._again(form, at) for form, at in shown.items())
        return [case for case in series if len(case.strikes) >= LEAST_AGAIN]

    def _again(self, form: Form, shown: Sequence[Sequence[int]]) -> Case:
        """Return a fault each time that the one before has healed, from when outputs are on."""
        begin = bisect_left(self._use_times, self._on_at)
        first = [place for places in shown for place in places[bisect_left(places, begin) :][:1]]
        if not first:
            return Case((), AT_START)
        strike = self._strike(form, min(first))
        every_s = (self.found.stated.healed + _BETWEEN) / SECOND
        times = 1 + int((self.found.mission.for_s - strike.at_s) / every_s)
        before = self.found.uses[min(first)].before
        return Case(strike.again(min(times, _MOST_AGAIN), every_s), before)

    def _amount(self, kind: Kind, use: int) -> float | None:
        """Return the amount of a kind at the use with this number; None is the kind's own.

        A push is as large as the robot bears, where it says that; every second one the other way.
        """
        if is_of_a_bit(kind):
            return float(_STRIDE * self._turns[use])
        if kind.is_numbered:
            return float(number_of(use))
        if kind.of != "world" or kind.amount is None:
            return None
        bears_push = self.found.bears_push(self._use_times[use])
        if number_of(use) % 2:
            return -(kind.amount if bears_push is None else bears_push)
        return bears_push

    def _pair(self, index: int) -> Case:
        first = (index * GOLDEN % (1 << BITS)) * self.singles >> BITS
        place = bisect_right(self._ends, first)
        begin = self._ends[place - 1] if place else 0
        last = bisect_right(self._use_times, self._use_times[place] + PAIRED_WITHIN) - 1
        count = self._ends[last] - begin
        second = begin + ((index * OTHER % (1 << BITS)) * count >> BITS)
        if second == first:
            second = begin + (second + 1 - begin) % count
        cases = [self[each] for each in sorted((first, second))]
        return Case(tuple(each.strikes[0] for each in cases), cases[0].before)

    def alike(self, number: int) -> range:
        """Return the numbers of the cases that differ in nothing but how long their fault lasts.

        One of several faults is alike to none.
        """
        if number >= self.singles:
            return range(number, number + 1)
        place = bisect_right(self._ends, number)
        begin = self._ends[place - 1] if place else 0
        forms = self._forms_at(self.found.uses[place])
        first = last = number - begin
        while first > 0 and forms[first - 1][:2] == forms[last][:2]:
            first -= 1
        while last + 1 < len(forms) and forms[last + 1][:2] == forms[first][:2]:
            last += 1
        return range(begin + first, begin + last + 1)

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Kinds that are in it, each with the device."""
        forms = (form for each in self._by_use.values() for form in each)
        return list(dict.fromkeys((form.kind.name, form.device) for form in forms))

    @cached_property
    def _on_at(self) -> int:
        """When outputs are first on, ns; 0 where they never are."""
        on = self.found.on
        return on.index(True) * EVERY if True in on else 0

    @cached_property
    def started(self) -> int:
        """The number of the first single fault that strikes when outputs have been on."""
        place = bisect_left(self._use_times, self._on_at)
        return self._ends[place - 1] if place else 0

    def by_fault(self) -> "list[array[int]]":
        """Return the numbers of single faults by kind and device, each in order of time."""
        found: dict[tuple[str, str], array[int]] = {}
        number = 0
        for use in self.found.uses:
            for form in self._forms_at(use):
                found.setdefault((form.kind.name, form.device), array("q")).append(number)
                number += 1
        return list(found.values())

    @cached_property
    def _turns(self) -> dict[int, int]:
        """When it is the turn of each use that reads, by its number, among those of its chip."""
        reading: dict[tuple[str, int | None], list[int]] = {}
        for number, use in enumerate(self.found.uses):
            if use.use.reads:
                reading.setdefault((use.line, use.use.address), []).append(number)
        return {
            numbers[place]: turn
            for numbers in reading.values()
            for turn, place in enumerate(spread(len(numbers), FIRST_BIT))
        }

    def _forms_at(self, use: UseOfLine) -> tuple[Form, ...]:
        key = _key(use)
        if key not in self._by_use:
            without = {*self.found.mission.without, *self.found.stated.unknowable}
            self._by_use[key] = tuple(
                form
                for form in self._new_forms_at(use)
                if without.isdisjoint({form.kind.name, f"{form.kind.name}:{form.device}"})
            )
        return self._by_use[key]

    def _new_forms_at(self, use: UseOfLine) -> Iterator[Form]:
        for place in self.found.places:
            for kind in _kinds_at(place, use):
                spans = spans_of(kind)
                # once is the same on the bus as on the device that this use is of
                yield from (Form(kind, place.name, s) for s in spans[place.is_line :])
        if use.line == self._first_line:
            yield from (
                Form(each, "", span)
                for each in self.found.kinds
                if each.of in OF_NO_DEVICE
                for span in spans_of(each)
            )


@lru_cache(maxsize=4)
def space_of(mission: Mission) -> Space:
    """Return the space of a mission. Raises ConfigError for one that is not sound."""
    return Space(healthy(mission))


def _kinds_at(place: Place, use: UseOfLine) -> Sequence[Kind]:
    """Kinds that show at a place in this use of its line."""
    if place.line != use.line:
        return ()
    kinds = [KINDS[name] for name in place.kinds]
    if place.is_line:
        return [kind for kind in kinds if kind.name in HOLD_UP_A_LINE]
    if place.address != use.use.address:
        return ()
    return [kind for kind in kinds if use.use.shows(kind)]


def _key(use: UseOfLine) -> _Key:
    """Return what is equal for uses in which the same faults show."""
    return use.line, use.use.address, use.use.reads, use.use.writes


def is_of_a_bit(kind: Kind) -> bool:
    """Return whether it inverts one bit, or one byte, of what is read: there are many of them."""
    return kind.is_numbered and kind.of == "I2C"


def _is_small(form: Form) -> bool:
    """Return whether a fault is over at once, and moves no robot."""
    return form.for_s == 0.0 or (form.kind.is_moment and form.kind.of != "world")


def spans_of(kind: Kind) -> tuple[float | None, ...]:
    """How long a fault of a kind lasts: once, for a while, for ever, as far as it can."""
    if kind.is_moment:
        return (None,)
    a_while = _DISARMED_S if kind.of == "people" else _FOR_A_WHILE_S
    return (0.0, a_while, None) if kind.can_be_once else (a_while, None)
