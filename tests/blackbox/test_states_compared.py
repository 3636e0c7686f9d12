"""What is the same state and what is another: floats to the bit, whatever stands around them."""

import math
import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from firmware_runtime.recording.blackbox.state.keyframes import (
    FieldDifference,
    ForeignState,
    StateTable,
    UnkeepableState,
)
from tests.support.nodes import Node


class Pair(NamedTuple):
    left: float
    right: object


def not_a_number(payload: int) -> float:
    found: float = struct.unpack("<d", struct.pack("<Q", 0x7FF8 << 48 | payload))[0]
    return found


MAKES: dict[str, Callable[[float], object]] = {
    "by itself": lambda value: value,
    "in a set": lambda value: {value, 1.0},
    "as a key": lambda value: {value: 1},
    "in a tuple in a set": lambda value: frozenset({(value, 1)}),
    "complex": lambda value: complex(value, value),
    "a complex array": lambda value: np.array([complex(value, 1.0)]),
    "an array": lambda value: np.array([value]),
    "in a list": lambda value: [value],
    "in a record": lambda value: Pair(value, None),
}


def differences(then: object, now: object) -> list[FieldDifference]:
    """Of a state in which a field was that then, and is this now."""
    node = Node(value=None)
    table = StateTable({"node": node})
    node.value = then
    state = table.capture()
    node.value = now
    return list(table.differences(state))


@pytest.mark.parametrize("make", MAKES.values(), ids=MAKES)
def test_floats_are_the_same_to_the_bit(make: Callable[[float], object]) -> None:
    for bits in (not_a_number(1), not_a_number(2), -0.0, 0.5):
        assert differences(make(bits), make(bits)) == []
    assert differences(make(not_a_number(1)), make(not_a_number(2))) != []
    assert differences(make(0.0), make(-0.0)) != []


@pytest.mark.parametrize(
    ("then", "now", "found"),
    [
        (1, 1.0, ("node.value", 1, 1.0)),
        (True, 1, ("node.value", True, 1)),
        ([1, 2], [1, 3], ("node.value[1]", 2, 3)),
        ([1, 2], (1, 2), ("node.value", [1, 2], (1, 2))),
        (Pair(1.0, "a"), Pair(1.0, "b"), ("node.value.right", "a", "b")),
        ({"a": {"b": 1}}, {"a": {"b": 2}}, ("node.value['a']['b']", 1, 2)),
        (np.zeros(3), np.array([0.0, 2.0, 0.0]), ("node.value[1]", 0.0, 2.0)),
        ({1, 2}, {2, 3}, ("node.value", [1, 2], [2, 3])),
        (np.eye(1), np.zeros((1, 1)), ("node.value", [[1.0]], [[0.0]])),
        (np.eye(1), None, ("node.value", [[1.0]], None)),
    ],
)
def test_the_field_within_a_value_is_named(then: object, now: object, found: object) -> None:
    assert differences(then, now) == [found]


def test_a_function_that_is_no_more_what_it_was_built_as_is_named() -> None:
    node = Node(value=math.sqrt)
    table = StateTable({"node": node})
    state = table.capture()
    node.value = None
    assert list(table.differences(state)) == [("node.value", {"as built": []}, None)]


class Other:
    """Another class than a node's."""


def test_an_object_that_has_become_one_of_another_class_is_named() -> None:
    node = Node(inner=Node(rate=1.0))
    table = StateTable({"node": node})
    object.__setattr__(node.inner, "__class__", Other)
    with pytest.raises(UnkeepableState, match="a Node that has become a Other") as caught:
        table.capture()
    assert caught.value.path == "node.inner"


def test_an_array_of_another_shape_is_named_as_what_cannot_be_set_back() -> None:
    node = Node(value=np.zeros(3))
    table = StateTable({"node": node})
    node.value.resize(5, refcheck=False)
    state = table.capture()
    node.value.resize(3, refcheck=False)
    with pytest.raises(ForeignState, match="cannot be what a ndarray holds") as caught:
        table.restore(state)
    assert not caught.value.is_of_another_robot
    assert node.value.tolist() == [0.0, 0.0, 0.0]


def test_an_array_that_sees_what_another_holds_is_refused() -> None:
    """Made apart, the two would no longer see each other's changes."""
    node = Node(whole=None, part=None)
    table = StateTable({"node": node})
    node.whole = np.zeros(4)
    node.part = node.whole[1:]
    with pytest.raises(UnkeepableState, match="a view of another"):
        table.capture()
    node.part = np.arange(6.0).reshape(2, 3).T  # a view of what nothing else holds
    state = table.capture()
    node.part = None
    table.restore(state)
    assert node.part.tolist() == [[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]]


def test_a_generator_that_others_came_of_is_not_taken_for_a_fresh_one() -> None:
    node = Node(value=np.random.default_rng(1))
    table = StateTable({"node": node})
    node.value.spawn(1)
    with pytest.raises(UnkeepableState, match="spawned"):
        table.capture()


def test_a_wide_float_that_is_no_number_is_itself() -> None:
    node = Node(value=np.array([math.nan, 1.0], dtype=np.longdouble))
    table = StateTable({"node": node})
    assert list(table.differences(table.capture())) == []
