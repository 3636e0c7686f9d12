import array
import itertools
import math
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import NamedTuple

import msgspec
import numpy as np
import pytest

from firmware_runtime.blackbox.state.keyframes import (
    StateTable,
)
from tests.support.nodes import Node


class Colour(Enum):
    RED = 1
    BLUE = 2


class Pair(NamedTuple):
    left: float
    right: object


@dataclass(frozen=True)
class Frozen:
    value: float
    inner: object = None


@dataclass(slots=True)
class Slotted:
    first: object
    second: object = 2


class Message(msgspec.Struct):
    text: str
    items: list[int]


class Bag(list[object]):
    """A list with an attribute, as an input port is."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name


LATER: dict[str, object] = {
    "tuple": (1, "two", 3.0, None, True),
    "named tuple": Pair(1.5, [Pair(-0.0, ())]),
    "frozen": Frozen(2.5, Frozen(1.0)),
    "slotted": Slotted([1], {"a": 1}),
    "struct": Message("text", [1, 2]),
    "enumeration": Colour.BLUE,
    "class": Colour,
    "function": math.sin,
    "partial": partial(math.pow, 2.0),
    "deque": deque([1, 2], 3),
    "class of Python": ValueError,
    "ordered": OrderedDict([("b", 1), ("a", 2)]),
    "counter": Counter("abca"),
    "set": {1, 2, "three"},
    "frozen set": frozenset({(1, 2), (3,)}),
    "default": defaultdict(int, {"a": 1}),
    "bytes": bytearray(b"abc"),
    "numbers": array.array("d", [1.0, -0.0]),
    "array": np.array([[1.0, 2.0], [3.0, -0.0]]),
    "transposed": np.array([[1.0, 2.0], [3.0, 4.0]]).T,
    "number of numpy": np.float64(0.1),
    "large": 1 << 200,
    "complex": complex(-0.0, 2.0),
    "range": range(1, 9, 2),
    "count": itertools.count(7, 3),
    "iterator": iter((1, 2, 3)),
    "error": ValueError("text", 3),
    "bag": Bag("later"),
    "text": "\ud800 and ü",
    "infinite": -math.inf,
}


@pytest.mark.parametrize("value", LATER.values(), ids=LATER)
def test_what_was_made_later_comes_back(value: object) -> None:
    node = Node(value=None, again=None, colour=Colour.RED)
    table = StateTable({"node": node})
    node.value = node.again = value
    state = table.capture()
    node.value = node.again = None
    assert [each.path for each in table.differences(state)] == ["node.again", "node.value"]
    table.restore(state)
    assert list(table.differences(state)) == []
    assert type(node.value) is type(value)
    assert type(value) in (int, float) or node.value is node.again
    if not isinstance(value, Iterator):
        assert repr(node.value) == repr(value)
