"""Delivery in Parallel DEVS: how a value gets into bags, and how the simulator hears of it.

An output port that feeds one input port appends straight to that port's bag. One that feeds several
has a `FanOut` in its place, shared by all ports that feed the same ones. A model is noted as
reached before a bag of it gets its first value. A model with one input port is marked by that
port's bag itself; a model with several has `FilledBags` beside them. What a model does not use
costs it nothing.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import NOWHERE, InPort, OutPort, Register, StandIn

Bags: TypeAlias = tuple[InPort[Any], ...]
Stop: TypeAlias = tuple[InPort[Any], Register, object]
"""A bag, and which entry goes into which register before it gets its first value."""


class FilledBags(list[InPort[Any]]):
    """Those bags of a model with several that hold something: its mark, and its register."""

    def __init__(self, number: int, reached: list[int]) -> None:
        super().__init__()
        self._number = number
        self._reached = reached

    def append(self, bag: InPort[Any], /) -> None:
        """Note that `bag` is about to get its first value, the model's first or not."""
        if not self:
            self._reached.append(self._number)
        super().append(bag)

    def clear(self) -> None:
        """Empty the bags."""
        for bag in self:
            bag.clear()
        super().clear()


class FanOut(StandIn[Any]):
    """Several bags in the place of one; `is_used` while all of them are known to be filled."""

    __slots__ = ("_bags", "_stops", "_used", "is_used")

    def __init__(self, bags: Bags, stops: list[Stop], used: list["FanOut"]) -> None:
        self._bags = bags
        self._stops = stops
        self._used = used
        self.is_used = False

    def append(self, value: object, /) -> None:
        """Put one value into every bag, in order of declaration."""
        if not self.is_used:
            self._note()
        for bag in self._bags:
            bag.append(value)

    def _note(self) -> None:
        for bag, register, entry in self._stops:
            if not bag:
                register.append(entry)
        self.is_used = True
        self._used.append(self)


class Delivery:
    """The bags of a flat model: `marks` by number, and who was `reached` in this round.

    A mark is true while its model has input; clearing it empties the model's bags.
    """

    def __init__(self, numbers: Mapping[Component, int]) -> None:
        self.reached: list[int] = []
        self.marks: list[InPort[Any] | FilledBags] = []
        self._numbers = numbers
        self._used: list[FanOut] = []
        self._fan_outs: dict[Bags, FanOut] = {}
        for model, number in numbers.items():
            bags = list(model.in_ports.values())
            for bag in bags:
                bag.clear()
            self.marks.append(bags[0] if len(bags) == 1 else FilledBags(number, self.reached))

    def connect(self, port: OutPort[Any], ends: Sequence[InPort[Any]]) -> None:
        """Let `port` feed the input ports `ends`, in this order."""
        if len(ends) == 1:
            port.bag, port.register, port.entry = self._stop(ends[0])
        else:
            port.bag = self._fan_out(tuple(ends)) if ends else NOWHERE

    def end_round(self) -> None:
        """Forget who was reached, whose bags have been emptied by now."""
        self.reached.clear()
        for fan_out in self._used:
            fan_out.is_used = False
        self._used.clear()

    def _stop(self, bag: InPort[Any]) -> Stop:
        number = self._numbers[bag.owner]
        mark = self.marks[number]
        return (bag, self.reached, number) if mark is bag else (bag, mark, bag)

    def _fan_out(self, bags: Bags) -> FanOut:
        if bags not in self._fan_outs:
            stops = [self._stop(bag) for bag in dict.fromkeys(bags)]
            self._fan_outs[bags] = FanOut(bags, stops, self._used)
        return self._fan_outs[bags]
