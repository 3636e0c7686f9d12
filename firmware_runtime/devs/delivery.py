"""Delivery in Parallel DEVS: how a value gets into bags, and how the simulator learns of it.

An output port that feeds one input port appends straight to that port's bag. One that feeds several
has a `FanOut` in its place, shared by all ports that feed the same ones; bags that hold the same
whatever happens are filled from a pool of `sharing`. A model is noted as reached before a bag of it
gets its first value. A model with one input port is marked by that port's bag itself; a model with
several has `FilledBags` beside them. What a model does not use costs it nothing.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from firmware_runtime.devs.ports import NOWHERE, InPort, OutPort, Owner, Register, StandIn
from firmware_runtime.devs.sharing import Bags, Pool, pools
from firmware_runtime.devs.wiring import Feed

Stop: TypeAlias = tuple[InPort[Any] | Pool, Register, object]
"""A bag or pool, and which entry goes into which register before it gets its first value."""


class FilledBags(list[InPort[Any]]):
    """Those bags of a model with several that hold something: its mark, and its register."""

    __slots__ = ("_number", "_reached")

    def __init__(self, number: int, reached: list[int]) -> None:
        super().__init__()
        self._number = number
        self._reached = reached

    def append(self, bag: InPort[Any], /) -> None:
        """Note that `bag` is about to get its first value, the model's first or not."""
        if not self:
            self._reached.append(self._number)
        list.append(self, bag)  # in less time than by `super`

    def clear(self) -> None:
        """Empty the bags."""
        for bag in self:
            bag.clear()
        list.clear(self)


class FanOut(StandIn[Any]):
    """Several bags in the place of one; `is_used` while all of them are known to be filled."""

    __slots__ = ("_bags", "_stops", "_used", "is_used")

    def __init__(
        self, bags: Sequence[InPort[Any] | Pool], stops: list[Stop], used: list["FanOut"]
    ) -> None:
        self._bags = bags
        self._stops = stops
        self._used = used
        self.is_used = False

    def append(self, value: object, /) -> None:
        """Put one value into every bag, or the pool it is filled from."""
        if not self.is_used:
            for bag, register, entry in self._stops:
                if not bag:
                    register.append(entry)
            self.is_used = True
            self._used.append(self)
        for bag in self._bags:
            bag.append(value)


class Delivery:
    """The bags of a flat model: `marks` by number, and the models `reached` in this round.

    A mark is true while its model has input; clearing it empties the model's bags. `pools` are
    those that hold values; they are to be poured before any bag is read. After the round, its
    `used_fan_outs` are to be released.
    """

    def __init__(self, numbers: Mapping[Owner, int], feeds: Iterable[Feed]) -> None:
        self.reached: list[int] = []
        self.marks: list[InPort[Any] | FilledBags] = []
        self.pools: list[Pool] = []
        self._numbers = numbers
        self.used_fan_outs: list[FanOut] = []
        for model, number in numbers.items():
            bags = list(model.in_ports.values())
            for bag in bags:
                bag.clear()
            self.marks.append(bags[0] if len(bags) == 1 else FilledBags(number, self.reached))
        self._connect(feeds)

    def pour(self) -> None:
        """Fill the bags that have a pool."""
        for pool in self.pools:
            pool.pour()
        self.pools.clear()

    def release(self) -> None:
        """Have the fan-outs used in this round note again what they reach in the next."""
        for fan_out in self.used_fan_outs:
            fan_out.is_used = False
        self.used_fan_outs.clear()

    def _connect(self, feeds: Iterable[Feed]) -> None:
        alone: list[InPort[Any]] = []
        several: dict[Bags, list[OutPort[Any]]] = {}
        for port, ends in feeds:
            if len(ends) == 1:
                (end,) = ends
                _, port.register, port.entry = self._stop(end, end)
                port.bag = end
                alone.append(end)
            elif ends:
                several.setdefault(tuple(ends), []).append(port)
            else:
                port.bag = NOWHERE
        pool_of = {bag: pool for pool in pools(several, alone) for bag in pool.bags}
        for bags, ports in several.items():
            fan_out = self._fan_out(bags, pool_of)
            for port in ports:
                port.bag = fan_out

    def _stop(self, bag: InPort[Any], filled: InPort[Any] | Pool) -> Stop:
        """How it is noted that `bag`, or the pool `filled` in its place, gets its first value."""
        number = self._numbers[bag.owner]
        mark = self.marks[number]
        return (filled, self.reached, number) if mark is bag else (filled, mark, bag)

    def _fan_out(self, bags: Bags, pool_of: Mapping[InPort[Any], Pool]) -> FanOut:
        filled = [
            pool_of.get(bag, bag)
            for bag in bags
            if bag not in pool_of or bag is pool_of[bag].bags[0]  # each pool once
        ]
        stops = [self._stop(bag, pool_of.get(bag, bag)) for bag in dict.fromkeys(bags)]
        stops += [(pool, self.pools, pool) for pool in filled if isinstance(pool, Pool)]
        return FanOut(filled, stops, self.used_fan_outs)
