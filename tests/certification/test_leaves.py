"""The first number in which two recorded values differ is found, by the names that lead to it."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from drivers.thrust_pairs import Forces
from firmware_runtime.certification.leaves import first_leaf, units_apart
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.motion import Motion
from firmware_runtime.part_recording.states import States
from firmware_runtime.recording.values import encoded

NEXT = math.nextafter(0.1, 1.0)


@dataclass
class Gains:
    kp: float
    name: str = "yaw"


class Filter:
    """Of a class that no recording has words for: a state keeps its attributes."""

    def __init__(self, share: float) -> None:
        self.share = share
        self.motions = [Motion(share, 0.0)]


class Holder(Atomic):
    def __init__(self, share: float) -> None:
        super().__init__("holder")
        self.filter = Filter(share)


@pytest.mark.parametrize(
    ("recorded", "replayed", "path"),
    [
        (0.1, NEXT, ""),
        (Forces(1.0, 0.1, 2.0, 3.0), Forces(1.0, NEXT, 2.0, 3.0), "f2"),
        (Gains(0.1), Gains(NEXT), "kp"),
        ((1, (2, 0.1)), (1, (2, NEXT)), "1.1"),
        ([Motion(0.0, 0.1)], [Motion(0.0, NEXT)], "0.rate"),
        ({"a": 0.1}, {"a": NEXT}, "a"),
        (np.array([0.0, 0.1]), np.array([0.0, NEXT]), "1"),
    ],
)
def test_the_next_float_is_found_by_its_path(recorded: object, replayed: object, path: str) -> None:
    leaf = first_leaf(encoded(recorded), encoded(replayed))
    assert (leaf.path, leaf.units_apart) == (path, 1)
    assert (0.1).hex() in leaf.recorded
    assert NEXT.hex() in leaf.replayed


def test_what_a_state_keeps_of_an_object_is_looked_into() -> None:
    one, other = (States([Holder(share)]).changed()["holder.filter"] for share in (0.1, NEXT))
    assert first_leaf(one, other).path == "share"


def test_other_values_have_no_units_between_them() -> None:
    assert first_leaf(encoded("on"), encoded("off"))[1:] == ("'on'", "'off'", None)
    assert first_leaf(encoded(True), encoded(1))[1:] == ("True", "1", None)
    assert first_leaf(encoded((1,)), encoded((1, 2))) == ("1", "nothing", "2", None)
    assert first_leaf(b"\xc1", b"\xc1\xc1").recorded == repr(b"\xc1")


def test_zeros_of_either_sign_are_no_unit_apart_and_differ() -> None:
    assert units_apart(0.0, -0.0) == 0
    assert first_leaf(encoded(0.0), encoded(-0.0)).units_apart == 0
    assert units_apart(-5e-324, 5e-324) == 2
