"""What is the same state and what is another: floats to the bit, whatever stands around them."""

import math
import struct
from collections.abc import Callable

import numpy as np
import pytest

from firmware_runtime.blackbox.state.keyframes import (
    FieldDifference,
    ForeignState,
    StateTable,
    UnkeepableState,
)
from tests.support.nodes import Node


def not_a_number(payload: int) -> float:
    found: float = struct.unpack("<d", struct.pack("<Q", 0x7FF8 << 48 | payload))[0]
    return found


MAKES: dict[str, Callable[[float], object]] = {
    "in a set": lambda value: {value, 1.0},
    "as a key": lambda value: {value: 1},
    "in a tuple in a set": lambda value: frozenset({(value, 1)}),
    "complex": lambda value: complex(value, value),
    "a complex array": lambda value: np.array([complex(value, 1.0)]),
    "an array": lambda value: np.array([value]),
    "in a list": lambda value: [value],
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


def test_a_wide_float_that_is_no_number_is_itself() -> None:
    node = Node(value=np.array([math.nan, 1.0], dtype=np.longdouble))
    table = StateTable({"node": node})
    assert list(table.differences(table.capture())) == []


def test_the_order_of_keys_is_named() -> None:
    (found,) = differences({"a": 1, "b": 2}, {"b": 2, "a": 1})
    assert found.path == "node.value (the order of its keys)"


class Other:
    """Another class than a node's."""


def test_an_object_that_has_become_one_of_another_class_is_named() -> None:
    node = Node(inner=Node(rate=1.0))
    table = StateTable({"node": node})
    state = table.capture()
    object.__setattr__(node.inner, "__class__", Other)
    with pytest.raises(UnkeepableState, match="a Node that has become a Other") as caught:
        table.capture()
    assert caught.value.path == "node.inner"
    table.restore(state)
    assert type(node.inner) is Node


def test_an_attribute_of_a_function_is_state() -> None:
    def count() -> None:
        count.calls += 1  # type: ignore[attr-defined]

    count.calls = 0  # type: ignore[attr-defined]
    table = StateTable({"node": Node(count=count)})
    state = table.capture()
    count()
    assert [each.recorded for each in table.differences(state)] == [0]
    table.restore(state)
    assert count.calls == 0  # type: ignore[attr-defined]


def test_an_array_has_its_shape_again_and_may_be_written_to_as_before() -> None:
    node = Node(value=np.zeros(6))
    table = StateTable({"node": node})
    node.value.resize((2, 3), refcheck=False)
    node.value.flags.writeable = False
    state = table.capture()
    node.value.flags.writeable = True
    node.value.resize((6,), refcheck=False)
    node.value[0] = 1.0
    node.value.flags.writeable = False
    table.restore(state)
    assert node.value.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert not node.value.flags.writeable


def test_an_array_that_grew_is_named_as_what_cannot_be_set_back() -> None:
    node = Node(value=np.zeros(3))
    table = StateTable({"node": node})
    node.value.resize(5, refcheck=False)
    state = table.capture()
    node.value.resize(3, refcheck=False)
    with pytest.raises(ForeignState, match=r"shape \(3,\) that had shape \(5,\)") as caught:
        table.restore(state)
    assert not caught.value.is_of_another_robot


def test_an_array_of_every_second_item_is_not_set_back_to_another_shape() -> None:
    node = Node(value=np.zeros((2, 6))[:, ::2])
    state = StateTable({"node": node}).capture()
    flat = StateTable({"node": Node(value=np.zeros(12)[::2])})
    with pytest.raises(ForeignState, match=r"shape \(6,\) that had shape \(2, 3\)"):
        flat.restore(state)


def test_a_generator_that_others_came_of_is_not_taken_for_a_fresh_one() -> None:
    node = Node(value=np.random.default_rng(1))
    fresh = StateTable({"node": Node(value=np.random.default_rng(1))})
    table = StateTable({"node": node})
    node.value.spawn(1)
    with pytest.raises(ForeignState, match="spawned"):
        fresh.restore(table.capture())
    table.restore(table.capture())


class Silent:
    """Says nothing of itself."""

    def __repr__(self) -> str:
        raise RuntimeError("no word")


def test_what_a_model_raises_when_it_is_looked_at_is_said() -> None:
    with pytest.raises(UnkeepableState, match="RuntimeError: no word"):
        StateTable({"node": Node(value={Silent(), Silent()})})
    with pytest.raises(UnkeepableState, match="an array of objects") as caught:
        StateTable({"node": Node(value=np.array([1, None], dtype=object))})
    assert caught.value.path == "node.value"


def test_the_only_object_in_a_set_needs_no_text() -> None:
    tables = [StateTable({"node": Node(value={Silent()})}) for _ in range(2)]
    assert tables[0].fingerprint == tables[1].fingerprint
