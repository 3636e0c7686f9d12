"""Delivery in Parallel DEVS: an output port's `send` becomes a closure that fills bags.

A value goes straight into the bags at the ends of its wires. A model is noted as reached by the
first value it gets, which it is told by its `mark`, a list that is empty until then. A model with
one input port uses that port's bag as its mark, so noting costs no more than a look at the bag; a
model with several keeps a list of those of its bags that hold something.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort, discard

Send: TypeAlias = Callable[[Any], None]
Note: TypeAlias = Callable[[Any], None]
Stop: TypeAlias = tuple[list[Any], Note, object]
"""A bag, and what to call, with what, when it gets its first value."""


class Delivery:
    """The bags of a flat model: who was `reached` in this round; `marks` and `clears` by number."""

    def __init__(self, atomics: Iterable[Atomic]) -> None:
        self.reached: list[int] = []
        self.marks: list[list[Any]] = []
        self.clears: list[Callable[[], None]] = []
        self._stops: dict[InPort[Any], Stop] = {}
        for number, atomic in enumerate(atomics):
            self._open(number, list(atomic.in_ports.values()))

    def sender(self, ends: Sequence[InPort[Any]]) -> Send:
        """The function that delivers a value to every end of a wire, in order."""
        stops = [self._stops[end] for end in ends]
        if not stops:
            return discard
        return _to_one(*stops[0]) if len(stops) == 1 else _to_many(stops)

    def _open(self, number: int, bags: list[InPort[Any]]) -> None:
        for bag in bags:
            bag.clear()
        if len(bags) == 1:
            mark: list[Any] = bags[0]
            self._stops[bags[0]] = (bags[0], self.reached.append, number)
            self.clears.append(mark.clear)
        else:
            ...
        self.marks.append(mark)


def _to_one(bag: list[Any], note: Note, what: object) -> Send:
    def send(value: object) -> None:
        if not bag:
            note(what)
        bag.append(value)

    return send


def _to_many(stops: list[Stop]) -> Send:
    def send(value: object) -> None:
        for bag, note, what in stops:
            if not bag:
                note(what)
            bag.append(value)

    return send
