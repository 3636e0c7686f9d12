"""The same value comes back, floats to the bit; nothing of a file is run."""

import struct
from enum import Enum, Flag
from typing import NamedTuple

import msgspec
import numpy as np
import pytest
from firmware_drivers.thrust_pairs import Forces
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.motion import Motion
from firmware_runtime.recording.value_writer import DEEPEST
from firmware_runtime.recording.values import Reader, UnknownValue, encoded, made, unpack


class Colour(Enum):
    RED = 1


class Leak(Flag):
    BOW = 1
    STERN = 2


class Reading(msgspec.Struct, frozen=True):
    items: list[int]

    def __post_init__(self) -> None:
        self.items.append(len(self.items))


class Pair(NamedTuple):
    left: object
    right: object


floats = st.integers(0, 2**64 - 1).map(lambda bits: struct.unpack("<d", struct.pack("<Q", bits))[0])
leaves = (
    st.none() | st.booleans() | st.integers() | floats | st.text(max_size=5) | st.binary(max_size=5)
)
values = st.recursive(
    leaves | st.just(Colour.RED),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.tuples(inner, inner).map(lambda both: Pair(*both))
        | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    ),
    max_leaves=8,
)


@pytest.mark.slow
@given(values)
def test_what_is_read_back_is_the_same_to_the_bit(value: object) -> None:
    back = made(unpack(encoded(value)))
    assert type(back) is type(value)
    assert encoded(back) == encoded(value)


@pytest.mark.parametrize(
    "value",
    [
        *(Forces(1.0, -0.0, 2.0, 3.0), Motion(1.0, 2.0), Fault("NoAcknowledge", "no answer", 1)),
        *(np.float64(0.1), np.arange(6.0).reshape(2, 3)),
        *(Leak.BOW | Leak.STERN, Leak(0), Leak.STERN),
    ],
)
def test_what_ports_of_boards_carry_comes_back_as_its_own_type(value: object) -> None:
    back = made(unpack(encoded(value)))
    assert type(back) is type(value)
    assert encoded(back) == encoded(value)
    assert back is value or not isinstance(value, Flag)


@pytest.mark.parametrize("bits", [31, 32, 63, 64, 65])
def test_whole_numbers_of_any_size_come_back(bits: int) -> None:
    for value in (sign * (1 << bits) + off for sign in (1, -1) for off in (-1, 0, 1)):
        assert made(unpack(encoded(value))) == value


def test_zero_and_minus_zero_are_not_the_same() -> None:
    assert encoded(0.0) != encoded(-0.0)
    assert encoded(1) != encoded(1.0)


@pytest.mark.parametrize("value", [object(), lambda: 1, {object()}, np.array([object()])])
def test_what_cannot_be_written_down_is_refused(value: object) -> None:
    with pytest.raises(UnknownValue):
        encoded(value)


@pytest.mark.parametrize(
    "form",
    [
        {"os:system": ["true"]},
        {"subprocess:Popen": ["true"]},
        {"sys:modules.os.system": ["true"]},
        {"firmware_drivers.thrust_pairs:Forces": [1.0]},
        {"firmware_drivers.thrust_pairs:math.pi": []},
        {"no_such_module:Thing": []},
        {"msgspec.structs:FieldInfo": ["a", "a", 1, 2, 3]},
        {"array": ["|O", [1], b"\0" * 8]},
        {"tests.recording:Colour": ["BLUE"]},
        {},
        {7: []},
        {"int": 7},
        {"list": [], "dict": []},
    ],
)
def test_a_file_makes_only_records_that_the_model_knows(form: object) -> None:
    with pytest.raises(UnknownValue):
        made(form)


def test_what_has_not_been_made_yet_is_said_not_to_be() -> None:
    reader = Reader(known=lambda number: number)
    with pytest.raises(UnknownValue, match="nothing has been made as that"):
        reader.made({"list": [{"same": [0]}]})


def test_a_struct_comes_back_as_it_was_after_its_own_function() -> None:
    assert made(unpack(encoded(Reading([7])))).items == [7, 1]


class Unreadable:
    """Says that it holds fields, and has none."""

    __dataclass_fields__ = None


def within_itself() -> list[object]:
    made: list[object] = []
    made.append(made)
    return made


def test_values_within_values_are_written_as_deep_as_they_are_read() -> None:
    deep: list[object] = []
    for _ in range(DEEPEST - 1):
        deep = [deep]
    assert made(unpack(encoded(deep))) == deep
    with pytest.raises(UnknownValue, match=f"over {DEEPEST} values within each other"):
        encoded([deep])


@pytest.mark.parametrize("value", [within_itself(), (within_itself(),), Unreadable()])
def test_what_cannot_be_looked_at_is_unknown(value: object) -> None:
    with pytest.raises(UnknownValue, match="cannot be recorded"):
        encoded(value)
