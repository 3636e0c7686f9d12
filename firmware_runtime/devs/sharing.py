"""Sharing: bags that the very same ports feed hold the same values, so these are kept once.

Where several ports feed the same several bags, as in layers of models coupled all to all, each
value goes into one pool instead of all those bags, and when a round's outputs have run, every bag
is filled from its pool at once. Models without such couplings have no pools.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from firmware_runtime.devs.ports import InPort

Bags: TypeAlias = tuple[InPort[Any], ...]


class Pool(list[object]):
    """The values that this round has brought for several bags."""

    def __init__(self, bags: Bags) -> None:
        super().__init__()
        self.bags = bags

    def pour(self) -> None:
        """Move the values into every bag."""
        for bag in self.bags:
            bag.extend(self)
        self.clear()


def pools(several: Mapping[Bags, Sequence[object]], alone: Iterable[InPort[Any]]) -> list[Pool]:
    """The pools worth having, given the ports that feed several bags, by these.

    Bags that are `alone`, as some port feeds one of them and nothing else, share with no other.
    """
    ports = [len(each) for each in several.values()]
    if max(ports, default=0) < 2:
        return []
    routes: defaultdict[InPort[Any], list[int]] = defaultdict(list)
    for route, bags in enumerate(several):
        for bag in bags:
            routes[bag].append(route)
    for bag in alone:
        routes.pop(bag, None)
    alike: defaultdict[tuple[int, ...], list[InPort[Any]]] = defaultdict(list)
    for bag, ways in routes.items():
        alike[tuple(ways)].append(bag)
    return [
        Pool(tuple(bags))
        for ways, bags in alike.items()
        if len(bags) > 1 and sum(ports[way] for way in set(ways)) > 1
    ]
