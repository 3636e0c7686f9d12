"""Values of a link come out as they went in, bit for bit, or are refused."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from firmware_runtime.links.cut.cut import Crossing
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.typed_values import packed_form


class Gear(Enum):
    LOW = 1
    HIGH = 2


@dataclass(frozen=True, slots=True)
class Angle:
    value: float


@dataclass(frozen=True, slots=True)
class Degree(Angle):
    name: str


class Sample(NamedTuple):
    where: tuple[float, float, float]
    field: tuple[float, ...] | None
    gear: Gear
    angles: list[Angle]
    by_name: dict[str, int]
    raw: bytes


AN_ARRAY_OF_ONE = b"\x91"
floats = st.floats(allow_nan=False, allow_infinity=False)
angles = st.one_of(st.builds(Angle, floats), st.builds(Degree, floats, st.text()))
samples = st.builds(
    Sample,
    st.tuples(floats, floats, floats),
    st.none() | st.lists(floats).map(tuple),
    st.sampled_from(Gear),
    st.lists(angles),
    st.dictionaries(st.text(), st.integers()),
    st.binary(),
)


def crossing(kind: object, limits: tuple[float, float] | None = None) -> Crossing:
    return Crossing("model.port", 1, packed_form(kind), limits)


def again(kind: object, value: object) -> object:
    (found,) = crossing(kind).unpacked(crossing(kind).packed([value]))
    return found


def reason_of(kind: object, packed: bytes, limits: tuple[float, float] | None = None) -> Reason:
    with pytest.raises(Refused) as refused:
        crossing(kind, limits).unpacked(packed)
    return refused.value.reason


@pytest.mark.slow
@given(samples)
def test_a_value_comes_out_as_it_went_in(sample: Sample) -> None:
    found = again(Sample, sample)
    assert found == sample
    assert repr(found) == repr(sample), "types too, and the sign of zero"


@given(angles)
def test_a_subclass_stays_one(angle: Angle) -> None:
    found = again(Angle, angle)
    assert type(found) is type(angle)
    assert found == angle


@pytest.mark.parametrize("value", [1, 1.0, -0.0, True, 2**70, np.float64(2.5)])
def test_a_number_keeps_its_type(value: float) -> None:
    kind = float if not isinstance(value, int) or isinstance(value, bool) else int
    found = again(kind, value)
    assert (type(found), repr(found)) == (type(value), repr(value))


def test_a_whole_number_in_a_port_of_float_stays_one() -> None:
    assert repr(again(float, 1)) == "1"


def test_an_array_keeps_its_shape() -> None:
    array = np.arange(6.0).reshape(2, 3)
    found = again(NDArray[np.float64], array)
    assert isinstance(found, np.ndarray)
    assert found.dtype == array.dtype
    assert np.array_equal(found, array)


@pytest.mark.parametrize("kind", [float, int, str, Gear, Angle, Sample, NDArray[np.float64]])
@given(st.binary(max_size=60))
def test_any_bytes_are_a_value_or_refused(kind: object, packed: bytes) -> None:
    for body in (packed, AN_ARRAY_OF_ONE + packed):
        try:
            values = crossing(kind).unpacked(body)
        except Refused:
            continue
        crossing(kind).packed(values)


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(number: float) -> None:
    assert reason_of(float, crossing(float).packed([number])) is Reason.NOT_FINITE
    assert reason_of(Angle, crossing(Angle).packed([Degree(number, "x")])) is Reason.NOT_FINITE
    array = NDArray[np.float64]
    assert reason_of(array, crossing(array).packed([np.array([1.0, number])])) is Reason.NOT_FINITE


def test_every_number_must_be_within_the_limits() -> None:
    pair = crossing(tuple[float, float], (-1.0, 1.0))
    assert pair.unpacked(pair.packed([(-1.0, 1.0)])) == [(-1.0, 1.0)]
    packed = pair.packed([(0.0, 1.5)])
    assert reason_of(tuple[float, float], packed, (-1.0, 1.0)) is Reason.OUT_OF_LIMITS


def test_only_subclasses_that_are_here_are_made() -> None:
    packed = crossing(Angle).packed([Degree(1.0, "x")])
    assert reason_of(Angle, packed.replace(b"Degree", b"Minute")) is Reason.MALFORMED
    assert reason_of(Gear, packed) is Reason.MALFORMED


@pytest.mark.parametrize("kind", [object, tuple, list, Any, dict[int, float]])
def test_a_type_that_leaves_it_open_cannot_be_carried(kind: object) -> None:
    with pytest.raises(TypeError):
        packed_form(kind)


def test_the_text_of_a_type_names_its_class_and_fields() -> None:
    assert packed_form(Angle).text == 'Angle({"value": float})'
    assert packed_form(Gear).text == 'Gear("LOW" | "HIGH")'
    assert '"where": tuple([float, float, float])' in packed_form(Sample).text
    assert packed_form(list[int]).text == "list([int, ...])"
    assert packed_form(tuple[int, ...]).text == "tuple([int, ...])"
