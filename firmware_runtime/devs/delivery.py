"""Delivery in Parallel DEVS: an output port's `send` becomes a closure that fills bags.

A value goes straight into the bags at the ends of its wires. A model is noted as reached when it
gets its first value, which shows on its `mark`, a list that is empty until then. A model with one
input port uses that port's bag as its mark, so noting costs no more than a look at the bag; a model
with several keeps a list of those of its bags that hold something.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort, discard

Bag: TypeAlias = list[Any]
Send: TypeAlias = Callable[[Any], None]
Stop: TypeAlias = tuple[Bag, Callable[[Any], None], object]
"""A bag, and what to call, with what, before it gets its first value."""


class Delivery:
    """The bags of a flat model: who was `reached` in this round; `marks` and `clears` by number."""

    def __init__(self, atomics: Iterable[Atomic]) -> None:
        self.reached: list[int] = []
        self.marks: list[Bag] = []
        self.clears: list[Callable[[], None]] = []
        self._stops: dict[InPort[Any], Stop] = {}
        for number, atomic in enumerate(atomics):
            bags = list(atomic.in_ports.values())
            for bag in bags:
                bag.clear()
            if len(bags) == 1:
                self._open_one(number, bags[0])
            else:
                self._open_several(number, bags)

    def sender(self, ends: Sequence[InPort[Any]]) -> Send:
        """The function that delivers a value to every end of a wire, in order."""
        stops = [self._stops[end] for end in ends]
        if not stops:
            return discard
        return _to_one(*stops[0]) if len(stops) == 1 else _to_several(stops)

    def _open_one(self, number: int, bag: InPort[Any]) -> None:
        self.marks.append(bag)
        self.clears.append(bag.clear)
        self._stops[bag] = (bag, self.reached.append, number)

    def _open_several(self, number: int, bags: list[InPort[Any]]) -> None:
        filled: list[Bag] = []
        reach = self.reached.append

        def note(bag: Bag) -> None:
            if not filled:
                reach(number)
            filled.append(bag)

        def clear() -> None:
            for bag in filled:
                bag.clear()
            filled.clear()

        self.marks.append(filled)
        self.clears.append(clear)
        self._stops.update((bag, (bag, note, bag)) for bag in bags)


def _to_one(bag: Bag, note: Callable[[Any], None], what: object) -> Send:
    def send(value: object) -> None:
        if not bag:
            note(what)
        bag.append(value)

    return send


def _to_several(stops: Sequence[Stop]) -> Send:
    def send(value: object) -> None:
        for bag, note, what in stops:
            if not bag:
                note(what)
            bag.append(value)

    return send
