"""A set has another order in each process; what a list or a number is stays what it is."""

from dataclasses import dataclass
from typing import Any

import pytest
from msgspec import Struct, msgpack

from firmware_runtime.recording.replay.section_comparison import is_same_but_for_order


@dataclass
class Seen:
    names: object
    count: int = 1


class Told(Struct):
    names: object


class Listed(Struct, array_like=True, tag="listed"):
    names: object
    count: int = 1


class Renamed(Struct, rename="camel", tag_field="kind", tag="renamed", omit_defaults=True):
    all_names: object
    how_many: int = 1


@pytest.mark.parametrize(
    ("value", "form"),
    [
        ({"a", "b"}, ["b", "a"]),
        (frozenset({1, 2.0, None}), [None, 2.0, 1]),
        (({"a", "b"}, 1), [["b", "a"], 1]),
        ({"names": {"a", "b"}}, {"names": ["b", "a"]}),
        (Seen({"a", "b"}), {"names": ["b", "a"], "count": 1}),
        (Told({"a", "b"}), {"names": ["b", "a"]}),
        (Listed({"a", "b"}), ["listed", ["b", "a"], 1]),
        (Renamed({"a", "b"}), {"kind": "renamed", "allNames": ["b", "a"]}),
        ({frozenset({"a", "b"}), frozenset({"c", "d"})}, [["d", "c"], ["b", "a"]]),
        ({("x", frozenset({"a", "b"})), "y"}, ["y", ["x", ["b", "a"]]]),
        ({frozenset({"a", "b"}): 1}, {("b", "a"): 1}),
    ],
)
def test_the_order_of_a_set_is_no_difference(value: object, form: object) -> None:
    assert is_same_but_for_order(value, form)
    swapped = msgpack.decode(msgpack.encode(value))
    assert is_same_but_for_order(value, swapped)


@pytest.mark.parametrize(
    ("value", "form"),
    [
        ({"a", "b"}, ["a", "c"]),
        ({"a", "b"}, ["a"]),
        ({"a"}, "a"),
        (["a", "b"], ["b", "a"]),
        ({"x": 1, "y": 2}, {"y": 2, "x": 1}),
        ({0.0}, [-0.0]),
        ({1}, [1.0]),
        (Seen({"a"}), {"names": ["a"], "count": 2}),
        (Seen({"a"}), {"names": ["a"], "other": 1}),
        (1.0, 1),
        (Listed({"a"}), ["other", ["a"], 1]),
        (Listed({"a", "b"}), ["listed", ["b", "a"], 2]),
        (Renamed({"a", "b"}, 2), {"kind": "renamed", "allNames": ["b", "a"]}),
        (Renamed({"a", "b"}), {"kind": "renamed", "allNames": ["b", "a"], "howMany": 2}),
        ({frozenset({"a", "b"}), frozenset({"c", "d"})}, [["d", "c"], ["b", "c"]]),
        ({frozenset({"a", "b"}), "c"}, [["b", "a"], ["a", "b"]]),
        ({frozenset({"a", "b"}): 1}, {("b", "a"): 2}),
    ],
)
def test_anything_else_is_one(value: Any, form: Any) -> None:  # noqa: ANN401 -- whatever is sent
    assert not is_same_but_for_order(value, form)
