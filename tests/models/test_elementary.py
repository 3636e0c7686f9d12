import hashlib
import math
import random
import struct
from collections.abc import Callable, Iterator

import pytest

from firmware_runtime.system import elementary
from tests.support.true_values import units_off

ANGLES = (1.0, 7.0, 1e3, 1e6)
SPECIAL = (0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 1e-320, 1e308)


@pytest.mark.parametrize("name", ["sin", "cos"])
@pytest.mark.parametrize("largest", ANGLES)
def test_sine_and_cosine_are_within_two_and_a_half_units(name: str, largest: float) -> None:
    function = getattr(elementary, name)
    for (x,) in _seeded(lambda of: (of.uniform(-largest, largest),)):
        assert units_off(name, function(x), x) < 2.5


@pytest.mark.parametrize("name", ["atan2", "hypot"])
def test_arc_tangent_and_length_are_within_two_and_a_half_units(name: str) -> None:
    function = getattr(elementary, name)
    for y, x in _seeded(lambda of: (of.gauss() * 10 ** of.uniform(-9, 9), of.gauss())):
        assert units_off(name, function(y, x), y, x) < 2.5


@pytest.mark.parametrize(("name", "most"), [("exp", 2.5), ("expm1", 4.0)])
@pytest.mark.parametrize("largest", [0.1, 2.0, 700.0])
def test_exponentials_are_close(name: str, most: float, largest: float) -> None:
    function = getattr(elementary, name)
    for (x,) in _seeded(lambda of: (of.uniform(-largest, largest),)):
        assert units_off(name, function(x), x) < most


def test_both_at_once_are_the_two() -> None:
    for (x,) in _seeded(lambda of: (of.uniform(-2e6, 2e6),)):
        assert elementary.cos_sin(x) == (elementary.cos(x), elementary.sin(x))


@pytest.mark.parametrize("y", SPECIAL)
@pytest.mark.parametrize("x", SPECIAL)
def test_zeros_infinities_and_what_is_no_number_are_as_in_math(y: float, x: float) -> None:
    for name in ("atan2", "hypot"):
        ours, theirs = getattr(elementary, name)(y, x), getattr(math, name)(y, x)
        assert math.isclose(ours, theirs) or (math.isnan(theirs) and math.isnan(ours))
        assert math.copysign(1.0, ours) == math.copysign(1.0, theirs) or math.isnan(theirs)


def test_an_infinite_angle_is_refused_and_no_number_stays_none() -> None:
    for function in (elementary.sin, elementary.cos, elementary.cos_sin):
        with pytest.raises(ValueError, match="math domain error"):
            function(math.inf)
    assert math.isnan(elementary.sin(math.nan))
    assert math.isnan(elementary.cos(math.nan))


def test_powers_of_e_end_as_those_of_math() -> None:
    assert elementary.exp(-math.inf) == elementary.exp(-800.0) == 0.0
    assert elementary.exp(math.inf) == math.inf
    assert math.isnan(elementary.exp(math.nan))
    assert elementary.expm1(-800.0) == -1.0
    with pytest.raises(OverflowError):
        elementary.exp(710.0)


@pytest.mark.parametrize(
    ("name", "bits"),
    [
        ("sin", "4e99db5ffcd379b1"),
        ("cos", "22b2d5f169815f52"),
        ("atan2", "632284a6f4351e5b"),
        ("hypot", "20db7ebf187f3647"),
        ("exp", "5822780fa0299841"),
        ("expm1", "05a5cf1098b8570e"),
    ],
)
def test_the_bits_are_those_of_every_other_machine(name: str, bits: str) -> None:
    """Digests taken on CPython 3.11 on x86-64."""
    some, state = [], 20261122
    for _ in range(1000):
        state = (state * 6364136223846793005 + 1442695040888963407) % (1 << 64)
        some.append(((state >> 11) / (1 << 52) - 1.0) * 10.0)
    given = zip(some, some[::-1], strict=True) if name in {"atan2", "hypot"} else zip(some)
    found = [getattr(elementary, name)(*each) for each in given]
    assert hashlib.sha256(struct.pack("<1000d", *found)).hexdigest()[:16] == bits


def _seeded(
    pick: Callable[[random.Random], tuple[float, ...]], count: int = 150
) -> Iterator[tuple[float, ...]]:
    source = random.Random(20261122)  # noqa: S311 -- no secret
    return (pick(source) for _ in range(count))
