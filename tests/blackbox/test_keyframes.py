import array
import itertools
import math
import random
import struct
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest

from firmware_runtime.blackbox.state.keyframes import (
    ABSENT,
    StateTable,
    UnkeepableState,
)
from tests.support.nodes import Node


class Bag(list[object]):
    """A list with attributes, as an input port is."""


class Pair(NamedTuple):
    left: float
    right: object


@dataclass(slots=True)
class Slotted:
    first: object
    second: object = 2


def changed_and_restored(node: Node, change: Callable[[], object]) -> list[str]:
    """The paths that a change made; afterwards the node is as it was before."""
    table = StateTable({"node": node})
    state = table.capture()
    assert list(table.differences(state)) == []
    change()
    paths = [each.path for each in table.differences(state)]
    later = table.capture()
    table.restore(state)
    assert list(table.differences(state)) == []
    table.restore(later)
    assert list(table.differences(later)) == []
    table.restore(state)
    return paths


def test_an_array_keeps_its_order_in_memory() -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    node.value = np.arange(6.0).reshape(2, 3).T
    state = table.capture()
    table.restore(state)
    assert node.value.flags.f_contiguous
    assert node.value.flags.writeable
    assert not node.value.flags.c_contiguous


def test_known_containers_keep_their_identity() -> None:
    bag, row, queue, names = Bag(), {"a": 1}, deque([1, 2]), {"x"}
    counts, weights = bytearray(3), np.zeros(3)
    node = Node(put=bag.append, read=row.get, parts=(queue, names), raw=[counts, weights])

    def change() -> None:
        bag.append(1)
        row["b"] = 2
        queue.append(3)
        names.add("y")
        counts[1] = 7
        weights[2] = -0.0

    paths = changed_and_restored(node, change)
    assert len(paths) == 6
    assert (bag, row, queue, names) == ([], {"a": 1}, deque([1, 2]), {"x"})
    assert (counts, weights.tobytes()) == (bytearray(3), bytes(24))
    node.put("again")
    assert bag == ["again"]


def test_closures_keep_their_cells() -> None:
    total = 0

    def count(by: int) -> int:
        nonlocal total
        total += by
        return total

    node = Node(count=count)
    assert changed_and_restored(node, lambda: count(5)) == ["node.count.<total>[0]"]
    assert count(1) == 1


def test_objects_with_slots_and_unset_ones_are_set_back() -> None:
    slotted = Slotted(1.0)
    node = Node(held=slotted)
    assert changed_and_restored(node, lambda: delattr(slotted, "second")) == ["node.held.second"]
    assert slotted == Slotted(1.0)


def test_attributes_come_and_go() -> None:
    node = Node(old=1)

    def change() -> None:
        del node.old
        node.new = [node, Pair(1.0, node)]

    assert changed_and_restored(node, change) == ["node.old", "node.new"]
    assert vars(node) == {"old": 1}


def test_generators_of_random_numbers_go_on_where_they_were() -> None:
    own, of_numpy = random.Random(1), np.random.default_rng(1)  # noqa: S311 -- to be repeated
    node = Node(own=own, of_numpy=of_numpy)

    def draw() -> tuple[float, ...]:
        return own.random(), own.gauss(0, 1), of_numpy.normal(), float(of_numpy.integers(9))

    table = StateTable({"node": node})
    draw()
    state = table.capture()
    drawn = draw()
    assert {path.partition("[")[0] for path, *_ in table.differences(state)} == {
        "node.own",
        "node.own.gauss_next",
        "node.of_numpy.bit_generator",
    }
    table.restore(state)
    assert draw() == drawn


def test_memory_behind_views_is_kept_once() -> None:
    memory = memoryview(array.array("q", bytes(8 * 5000)))
    node = Node(all=memory, part=memory[10:20], other=memory[100:])
    table = StateTable({"node": node})
    memory[4] = -5
    memory[4999] = 1
    state = table.capture()
    assert len(state) < 2000
    node.part[1] = 7
    (found,) = table.differences(state)
    assert found == ("node.all[11]", ABSENT, 7)
    table.restore(state)
    assert (memory[4], memory[11], memory[4999], sum(memory)) == (-5, 0, 1, -4)


def test_a_view_made_later_is_one_of_the_same_memory() -> None:
    memory = memoryview(array.array("q", bytes(80)))
    node = Node(memory=memory, view=None)
    table = StateTable({"node": node})
    node.view = memory[2:4]
    state = table.capture()
    node.view = None
    table.restore(state)
    node.view[1] = 5
    assert memory[3] == 5
    node.view = memoryview(bytearray(8))
    with pytest.raises(UnkeepableState, match="memory that was made during the run"):
        table.capture()


def test_iterators_are_replaced_by_equal_ones() -> None:
    node = Node(steps=iter((1, 2, 3)), count=itertools.count(), of_list=iter([1, 2]))
    table = StateTable({"node": node})
    next(node.steps)
    next(node.count)
    state = table.capture()
    assert list(node.steps) == [2, 3]
    assert next(node.count) == 1
    assert [each.path for each in table.differences(state)] == ["node.count", "node.steps"]
    table.restore(state)
    assert (list(node.steps), next(node.count), list(node.of_list)) == ([2, 3], 1, [1, 2])


def test_a_generator_is_kept_when_it_is_through() -> None:
    def steps() -> Iterator[int]:
        yield 1

    node = Node(steps=steps())
    table = StateTable({"node": node})
    with pytest.raises(UnkeepableState, match=r"node\.steps: .*generator") as caught:
        table.capture()
    assert caught.value.path == "node.steps"
    assert list(node.steps) == [1]
    table.restore(table.capture())
    assert list(node.steps) == []


def test_floats_differ_to_the_bit() -> None:
    nan = struct.unpack("<d", b"\x01" + bytes(5) + b"\xf8\x7f")[0]
    node = Node(zero=0.0, nan=math.nan, inner=[Pair(0.0, np.float64(0.0))], array=np.zeros(2))
    table = StateTable({"node": node})
    state = table.capture()
    node.zero, node.nan, node.inner[0] = -0.0, nan, Pair(-0.0, np.float64(-0.0))
    node.array[1] = -0.0
    assert [each.path for each in table.differences(state)] == [
        "node.nan",
        "node.zero",
        "node.array[1]",
        "node.inner[0][0]",
        "node.inner[0][1]",
    ]


def test_the_order_of_keys_is_part_of_a_dictionary() -> None:
    table_of = {"a": 1, "b": 2}
    node = Node(table=table_of)

    def change() -> None:
        table_of["a"] = table_of.pop("a")

    assert changed_and_restored(node, change) == ["node.table (the order of its keys)"]
    assert [*table_of] == ["a", "b"]


def test_methods_and_functions_may_be_exchanged() -> None:
    def first() -> int:
        return 1

    def second() -> int:
        return 2

    node = Node(choice=first, others=[second], bound=None)

    def change() -> None:
        node.choice = second
        node.bound = node.act

    assert changed_and_restored(node, change) == ["node.bound", "node.choice"]
    assert node.choice() == 1


def test_loops_of_objects_made_later_come_back() -> None:
    node = Node(first=None)
    table = StateTable({"node": node})
    ring: list[object] = [Node(up=None)]
    ring[0].up = ring  # type: ignore[attr-defined]
    node.first = ring
    state = table.capture()
    node.first = None
    table.restore(state)
    assert node.first[0].up is node.first
    assert list(table.differences(state)) == []


def test_a_default_dictionary_is_kept() -> None:
    counts: defaultdict[str, list[int]] = defaultdict(list)
    node = Node(counts=counts)
    assert changed_and_restored(node, lambda: counts["new"].append(1)) == ["node.counts['new']"]
    assert counts["other"] == []


def test_every_object_has_a_path_of_its_own() -> None:
    first, second = Node(value=1), Node(value=1)
    node = Node(call=partial(print, first, second), other=partial(print, end=[[1], [1]]))
    table = StateTable({"node": node})
    state = table.capture()
    second.value = 2
    node.other.keywords["end"][1].append(2)
    found = list(table.differences(state))
    assert len(found) == len({each.path for each in found}) == 2


def test_a_dictionary_of_attributes_that_is_held_elsewhere_stays_the_same_one() -> None:
    inner = Node(value=1)
    node = Node(inner=inner, held=vars(inner))

    def change() -> None:
        inner.value = 2
        inner.more = [1]

    paths = changed_and_restored(node, change)
    assert paths == ["node.held['value']", "node.held['more']"]
    assert vars(inner) is node.held
    assert node.held == {"value": 1}
