"""Values in datagrams: what is received may be sent, and nothing else."""

import json
import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Raw

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.typed_values import json_form
from firmware_runtime.models.motion import Motion
from firmware_runtime.statistics.json_values import plain


class Gear(Enum):
    LOW = 1
    HIGH = 2


@dataclass(frozen=True, slots=True)
class Limits:
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError("low is above high")


class Order(NamedTuple):
    name: str
    gear: Gear
    is_urgent: bool
    limits: Limits
    corner: tuple[float, float]
    channels: tuple[int, ...]


@dataclass(frozen=True)
class Twice:
    once: float

    def __post_init__(self) -> None:
        raise RuntimeError("never")


@dataclass(frozen=True)
class Recipe:
    crop: Literal["tomato", "cress"]
    target: float | None
    gear: Gear | None = None
    label: int | str = "none"
    spans: tuple[Limits, ...] = ()
    shares: dict[str, float] = field(default_factory=dict)
    fed: float | list[Limits] | None = None


class Bed(msgspec.Struct, frozen=True):
    name: str
    recipes: list[Recipe] = []


class Vague(NamedTuple):
    whatever: object


finite = st.floats(allow_nan=False, allow_infinity=False)
whole = st.integers(-(1 << 63), (1 << 63) - 1)
texts = st.text(st.characters(exclude_categories=["Cs"]))
limits = st.tuples(finite, finite).map(lambda pair: Limits(min(pair), max(pair)))
recipes = st.builds(
    Recipe,
    st.sampled_from(["tomato", "cress"]),
    st.none() | finite,
    st.none() | st.sampled_from(Gear),
    whole | texts,
    st.lists(limits, max_size=3).map(tuple),
    st.dictionaries(texts, finite, max_size=3),
    st.none() | finite | st.lists(limits, max_size=3),
)
VALUES: dict[type[Any], st.SearchStrategy[Any]] = {
    bool: st.booleans(),
    int: whole,
    float: finite,
    str: texts,
    Gear: st.sampled_from(Gear),
    Motion: st.builds(Motion, finite, finite),
    Limits: limits,
    Order: st.builds(
        Order,
        texts,
        st.sampled_from(Gear),
        st.booleans(),
        limits,
        st.tuples(finite, finite),
        st.lists(whole).map(tuple),
    ),
    Recipe: recipes,
    Bed: st.builds(Bed, texts, st.lists(recipes, max_size=3)),
}


def read(kind: type[Any], said: bytes) -> object:
    """The value that a port of this type takes out of a datagram."""
    model = Coupled("model")
    model.in_port("port", kind)
    return Ports(model).arrival("port", Raw(said))[1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", VALUES)
@settings(deadline=None)
@given(data=st.data())
def test_what_a_trace_shows_is_read_back_as_it_was(kind: type[Any], data: st.DataObject) -> None:
    value = data.draw(VALUES[kind])
    again = read(kind, msgspec.json.encode(plain(value)))
    assert again == value
    assert type(again) is kind


@pytest.mark.parametrize("kind", VALUES)
@settings(deadline=None)
@given(datagram=st.binary(max_size=64) | st.text(max_size=64).map(str.encode))
def test_any_bytes_are_a_value_of_the_type_or_refused(kind: type[Any], datagram: bytes) -> None:
    try:
        value = read(kind, datagram)
    except Refusal:
        return
    assert type(value) is kind


@pytest.mark.slow
@settings(deadline=None)
@given(
    said=st.recursive(
        st.none() | st.booleans() | st.integers() | finite | texts,
        lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(Motion._fields), inner),
    )
)
def test_any_json_is_a_motion_of_two_finite_floats_or_refused(said: object) -> None:
    try:
        motion = read(Motion, json.dumps(said).encode())
    except Refusal:
        return
    assert isinstance(motion, Motion)
    assert all(type(each) is float and math.isfinite(each) for each in motion)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (float, b"true"),
        (float, b'"1.0"'),
        (float, b"null"),
        (float, b"NaN"),
        (float, b"Infinity"),
        (float, b'"inf"'),
        (float, b"1e999"),
        (float, b"[1.0]"),
        (int, b"1.0"),
        (int, b"true"),
        (int, b"9223372036854775808"),
        (bool, b"1"),
        (Gear, b"1"),
        (Gear, b'"MIDDLE"'),
        (Motion, b"[1.0, 2.0]"),
        (Motion, b'{"position": 1.0}'),
        (Motion, b'{"position": 1.0, "rate": 0.0, "jerk": 0.0}'),
        (Motion, b'{"position": 1.0, "rate": null}'),
        (Motion, b"[" * 4000),
        (Limits, b'{"low": 2.0, "high": 1.0}'),
        (Twice, b'{"once": 1.0}'),
        (Recipe, b'{"crop": "tomato"}'),
        (Recipe, b'{"crop": "oak", "target": 1.0}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "label": 1.5}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "label": null}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "shares": {"east": "all"}}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "spans": null}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "fed": {"low": 0.0, "high": 1.0}}'),
        (Recipe, b'{"crop": "cress", "target": 1.0, "price": 1.0}'),
    ],
)
def test_what_is_not_quite_a_value_of_the_type_is_refused(kind: type[Any], said: bytes) -> None:
    with pytest.raises(Refusal):
        read(kind, said)


def test_a_whole_number_is_a_float_too() -> None:
    value = read(float, b"1")
    assert type(value) is float
    assert value == 1.0


@pytest.mark.parametrize(
    ("kind", "said", "value"),
    [
        (Recipe, b'{"crop": "cress", "target": null}', Recipe("cress", None)),
        (Recipe, b'{"crop": "cress", "target": 1, "gear": null}', Recipe("cress", 1.0)),
        (Recipe, b'{"crop": "cress", "target": 1, "fed": 2}', Recipe("cress", 1.0, fed=2.0)),
        (Bed, b'{"name": "east"}', Bed("east")),
    ],
)
def test_a_field_with_a_default_may_be_left_out(
    kind: type[Any], said: bytes, value: object
) -> None:
    assert read(kind, said) == value


@pytest.mark.parametrize("kind", [tuple, list, dict, object, Vague, bytes])
def test_a_type_that_does_not_say_what_is_in_it_is_not_read(kind: type[Any]) -> None:
    with pytest.raises(TypeError):
        json_form(kind)
    with pytest.raises(Refusal, match="cannot be sent"):
        read(kind, b"1")


def test_a_refusal_says_which_field_is_wrong() -> None:
    with pytest.raises(Refusal, match="rate: 'fast': expected float"):
        read(Motion, b'{"position": 1.0, "rate": "fast"}')


class Share(msgspec.Struct, frozen=True):
    """Of one, with its limits in the type."""

    of_one: Annotated[float, msgspec.Meta(ge=0, le=1)]
    count: Annotated[int, msgspec.Meta(ge=1)] = 1
    at_most: Annotated[float, msgspec.Meta(le=2)] | None = None


@pytest.mark.parametrize(
    "said", [{"of_one": 5.0}, {"of_one": 0.5, "count": 0}, {"of_one": 0.5, "at_most": 3.0}]
)
def test_limits_in_a_type_are_kept(said: dict[str, float]) -> None:
    assert read(Share, b'{"of_one": 0.5, "at_most": 2}') == Share(0.5, 1, 2.0)
    with pytest.raises(Refusal):
        read(Share, json.dumps(said).encode())
