"""A robot's state is plain values: what it may hold comes back, in the objects of the robot."""

import array
import random
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, IntFlag
from functools import partial
from operator import is_
from typing import Any, NamedTuple

import numpy as np
import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.recording.blackbox.state.keyframes import ABSENT, ForeignState, StateTable
from tests.support.nodes import Node


class Mode(Enum):
    OFF = 0
    HELD = 1


class Bits(IntFlag):
    ONE = 1
    TWO = 2


class Pair(NamedTuple):
    left: float
    right: object


@dataclass(slots=True)
class Slotted:
    first: object
    second: object = 2


@dataclass
class Track:
    points: list[Pair] = field(default_factory=list)


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


VALUES: dict[str, object] = {
    "none": None,
    "a truth value": True,
    "a number of over 64 bits": 1 << 70,
    "a complex number": complex(1.0, -0.0),
    "bytes": b"\0\xff",
    "a member": Mode.HELD,
    "members of a flag": Bits.ONE | Bits.TWO,
    "a tuple": (1, ("a", 2.5)),
    "a list": [1, [2.0, None]],
    "a dictionary": {"a": 1, 2: [3], (1, Mode.OFF): "x"},
    "an ordered one": OrderedDict(b=1, a=2),
    "a set": {"a", 1, (2, 3)},
    "a frozen set": frozenset({Mode.OFF}),
    "a bounded row": deque([1, 2], 3),
    "a row": deque([Pair(1.0, "a")]),
    "changeable bytes": bytearray(b"abc"),
    "numbers": array.array("d", [1.0, -0.0]),
    "an array": np.arange(6.0).reshape(2, 3),
    "a number of numpy": np.float32(0.1),
    "a named tuple": Pair(0.5, [Pair(1.0, None)]),
    "a dataclass": Track([Pair(1.0, "x")]),
    "one with slots": Slotted(Mode.HELD),
}


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_a_plain_value_that_came_later_comes_back(value: Any) -> None:  # noqa: ANN401
    node = Node(value="as built")
    table = StateTable({"node": node})
    node.value = value
    state = table.capture()
    node.value = "something else"
    table.restore(state)
    assert type(node.value) is type(value)
    assert isinstance(value, set) or repr(node.value) == repr(value)
    assert table.capture() == state


def test_known_containers_keep_their_identity() -> None:
    bag, row, queue, names = [0], {"a": 1}, deque([1, 2]), {"x"}
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
    assert (bag, row, queue, names) == ([0], {"a": 1}, deque([1, 2]), {"x"})
    assert (counts, weights.tobytes()) == (bytearray(3), bytes(24))
    node.put("again")
    assert bag == [0, "again"]


def test_a_container_that_is_a_root_itself_is_set_back() -> None:
    items = [1]
    table = StateTable({"items": items})
    state = table.capture()
    items.append(2)
    table.restore(state)
    assert items == [1]


def test_a_helper_of_the_robot_is_gone_into_and_stays_the_same_one() -> None:
    inner = Node(rate=1.0)
    node = Node(inner=inner, act=inner.act, rows=[Node(count=0)])

    def change() -> None:
        inner.rate = 2.0
        node.rows[0].count += 1

    assert changed_and_restored(node, change) == ["node.inner.rate", "node.rows[0].count"]
    assert node.inner is inner
    assert node.act is not None


def test_one_helper_may_be_put_in_the_place_of_another() -> None:
    fast, slow = Node(gain=1.0), Node(gain=2.0)
    node = Node(fast=fast, slow=slow, active=fast, waiting=[])

    def change() -> None:
        node.active = slow
        node.waiting.append(fast)

    assert changed_and_restored(node, change) == ["node.active", "node.waiting[0]"]
    assert node.active is fast


def test_closures_keep_their_variables() -> None:
    total = 0

    def count(by: int) -> int:
        nonlocal total
        total += by
        return total

    node = Node(count=count)
    assert changed_and_restored(node, lambda: count(5)) == ["node.count.<total>.cell_contents"]
    assert count(1) == 1


def test_what_a_function_has_kept_among_its_defaults_is_set_back() -> None:
    def seen(value: int, before: list[int] = [], *, last: dict[str, int] = {}) -> None:  # noqa: B006
        before.append(value)
        last["value"] = value

    paths = changed_and_restored(Node(see=seen), lambda: seen(5))
    assert paths == ["node.see[0][0]", "node.see.last['value']"]


def test_objects_with_slots_and_unset_ones_are_set_back() -> None:
    slotted = Slotted(1.0)
    node = Node(held=slotted)
    assert changed_and_restored(node, lambda: delattr(slotted, "second")) == ["node.held.second"]
    assert slotted == Slotted(1.0)


def test_attributes_come_and_go() -> None:
    node = Node(old=1)

    def change() -> None:
        del node.old
        node.new = [Pair(1.0, "new")]

    assert changed_and_restored(node, change) == ["node.old", "node.new"]
    assert vars(node) == {"old": 1}
    table = StateTable({"node": node})
    state = table.capture()
    del node.old
    assert list(table.differences(state)) == [("node.old", 1, ABSENT)]


def test_a_field_may_be_called_as_the_ports_of_a_model_are() -> None:
    node = Node(in_ports=[1])
    assert changed_and_restored(node, lambda: node.in_ports.append(2)) == ["node.in_ports[1]"]


def test_any_number_of_things_may_be_held_by_two_places() -> None:
    node = Node(first=None, second=None)
    table = StateTable({"node": node})
    node.first = [[number] for number in range(1500)]
    node.second = [*node.first]
    state = table.capture()
    node.first = node.second = None
    table.restore(state)
    assert all(map(is_, node.first, node.second))
    assert node.first[-1] == [1499]


def test_what_two_places_hold_is_one_again() -> None:
    known = Node()
    node = Node(known=known, first=None, second=None, pair=None)
    table = StateTable({"node": node})
    shared, track = [Written.HERE_ALONE, 1], Track()
    node.first, node.second, node.pair = shared, {"known": known, "same": shared}, (track, track)
    state = table.capture()
    node.first = node.second = node.pair = None
    table.restore(state)
    node.first.append(2)
    assert node.second == {"known": known, "same": [Written.HERE_ALONE, 1, 2]}
    assert node.pair[0] is node.pair[1]


class Written(Enum):
    HERE_ALONE = 1


class Fixed(np.random.bit_generator.ISeedSequence):
    """A seed of a model's own, which counts no children."""

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> Any:  # noqa: ANN401 -- as numpy has it
        return np.arange(n_words, dtype=dtype)


def test_a_generator_by_a_models_own_seed_goes_on_where_it_was() -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    node.value = np.random.PCG64(Fixed())  # type: ignore[arg-type]  # its stubs know less
    state = table.capture()
    drawn = node.value.random_raw()
    table.restore(state)
    assert node.value.random_raw() == drawn


def test_generators_of_random_numbers_go_on_where_they_were() -> None:
    own, of_numpy = random.Random(1), np.random.default_rng(1)  # noqa: S311 -- to be repeated
    node = Node(own=own, of_numpy=of_numpy, later=None)

    def draw() -> tuple[float, ...]:
        return own.random(), own.gauss(0, 1), of_numpy.normal(), float(of_numpy.integers(9))

    table = StateTable({"node": node})
    draw()
    node.later = random.Random(2)  # noqa: S311 -- as above
    state = table.capture()
    drawn, of_later = draw(), node.later.random()
    assert {each.path for each in table.differences(state)} >= {"node.own", "node.later"}
    table.restore(state)
    assert (draw(), node.later.random()) == (drawn, of_later)


def test_a_record_is_made_without_its_own_function() -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    node.value = object.__new__(Loud)
    node.value.word = "kept"
    state = table.capture()
    node.value = None
    table.restore(state)
    assert (type(node.value), node.value.word) == (Loud, "kept")


@dataclass
class Loud:
    word: str

    def __post_init__(self) -> None:
        raise RuntimeError("made by its own function")


def test_a_method_that_is_bound_again_is_the_one_that_was_there() -> None:
    node = Node(call=None)
    node.call = node.act
    table = StateTable({"node": node})
    state = table.capture()
    node.call = node.act
    assert table.capture() == state


def test_the_order_of_keys_is_part_of_a_dictionary() -> None:
    table_of = {"a": 1, "b": 2}
    node = Node(table=table_of)

    def change() -> None:
        table_of["a"] = table_of.pop("a")

    assert changed_and_restored(node, change) == ["node.table (the order of its keys)"]
    assert [*table_of] == ["a", "b"]


def test_every_object_has_a_path_of_its_own() -> None:
    first, second = Node(value=1), Node(value=1)
    node = Node(call=partial(print, first, second), other=partial(print, end=[[1], [1]]))
    table = StateTable({"node": node})
    state = table.capture()
    second.value = 2
    node.other.keywords["end"][1].append(2)
    found = list(table.differences(state))
    assert len(found) == len({each.path for each in found}) == 2


class Decompressing:
    """A helper whose state is no attribute; it says itself what it is."""

    def __init__(self) -> None:
        self.machine = iter(range(10))
        self.taken = 0

    def take(self) -> int:
        self.taken += 1
        return next(self.machine)

    def state(self) -> dict[str, int]:
        return {"taken": self.taken}

    def restore(self, state: dict[str, int]) -> None:
        self.taken = state["taken"]
        self.machine = iter(range(self.taken, 10))


def test_an_object_may_declare_its_state() -> None:
    helper = Decompressing()
    node = Node(helper=helper)
    table = StateTable({"node": node})
    helper.take()
    state = table.capture()
    assert [helper.take(), helper.take()] == [1, 2]
    (found,) = table.differences(state)
    assert found == ("node.helper.taken", 1, 3)
    table.restore(state)
    assert helper.take() == 1


class Declaring(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.steps = iter("abc")
        self.given = 0
        self.helper = Node(count=0)

    def state(self) -> int:
        return self.given

    def restore(self, state: int) -> None:
        self.given = state
        self.steps = iter("abc"[state:])


def test_a_model_that_declares_it_has_phase_sigma_and_helpers_kept_beside() -> None:
    model = Declaring("model")
    table = StateTable({"model": model})
    next(model.steps)
    model.given = 1
    model.helper.count = 4
    model.hold_in("waiting", 7)
    state = table.capture()
    model.restore(0)
    model.helper.count = 0
    model.passivate()
    table.restore(state)
    assert (next(model.steps), model.phase, model.sigma, model.helper.count) == (
        *("b", "waiting", 7),
        4,
    )


def test_a_restore_that_raises_changes_nothing() -> None:
    class Refusing(Decompressing):
        def restore(self, state: dict[str, int]) -> None:
            if state["taken"] > 1:
                raise ValueError("too many")
            super().restore(state)

    node = Node(helper=Refusing(), value=1)
    table = StateTable({"node": node})
    before = table.capture()
    node.value = 2
    node.helper.taken = 5
    state = table.capture()
    table.restore(before)
    with pytest.raises(ForeignState, match="too many"):
        table.restore(state)
    assert (node.value, node.helper.taken) == (1, 0)
    assert table.capture() == before


def test_a_state_is_taken_up_by_a_robot_of_other_settings() -> None:
    """What the run had changed is set, and what it had not is as this one was built with."""
    recorded = Node(gain=1.0, integral=0.0, limits=[1.0], helper=Node(rate=1.0, count=0))
    table = StateTable({"node": recorded})
    recorded.integral, recorded.helper.count = 0.25, 3
    state = table.capture()
    tried = Node(gain=9.0, integral=0.0, limits=[2.0], helper=Node(rate=5.0, count=0))
    other = StateTable({"node": tried})
    other.restore(state)
    assert (tried.gain, tried.integral, tried.limits) == (9.0, 0.25, [2.0])
    assert (tried.helper.rate, tried.helper.count) == (5.0, 3)
    assert [each.path for each in other.differences(state)] == [
        "node.gain",
        "node.helper.rate",
        "node.limits",
    ]


def test_the_largest_field_is_named() -> None:
    node = Node(small=0, log=[])
    table = StateTable({"node": node})
    node.small = 7
    node.log += [0.5] * 100
    assert table.largest() == "node.log"
