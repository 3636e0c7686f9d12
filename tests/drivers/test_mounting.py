from contextlib import suppress
from itertools import permutations, product

import pytest
from firmware_drivers.chips.mounting import Mounting, parse_mounting

from firmware_runtime.errors import SettingError


def determinant(mounting: Mounting) -> int:
    i, j, k = mounting.axes
    parity = (j - i) * (k - i) * (k - j) // 2
    return parity * mounting.signs[0] * mounting.signs[1] * mounting.signs[2]


def spellings() -> list[str]:
    return [
        " ".join(sign + axis for sign, axis in zip(signs, axes, strict=True))
        for axes in permutations("xyz")
        for signs in product("+-", repeat=3)
    ]


def test_exactly_the_24_rotations_are_taken() -> None:
    taken = []
    for text in spellings():
        with suppress(SettingError):
            taken.append(parse_mounting(text))
    assert len(set(taken)) == 24
    assert {determinant(mounting) for mounting in taken} == {1}


def test_axes_are_named_in_order_and_composing_equals_turning_twice() -> None:
    mounting = parse_mounting("+y -x +z")
    assert mounting.factors((1.0, 10.0, 100.0)) == (10.0, -1.0, 100.0)
    outer, inner = parse_mounting("+y -x +z"), parse_mounting("-z +y +x")
    raw = (1.0, 10.0, 100.0)
    assert outer.of(inner).factors(raw) == outer.factors(inner.factors(raw))


NOT_ONCE = "expected each of x, y, z once with a sign"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("+x +y -z", r"'\+x \+y -z' is a mirror image; expected a rotation"),
        *((text, NOT_ONCE) for text in ("", "+x +y", "x y z", "+x +y +y", "+X +Y +Z")),
        *((text, NOT_ONCE) for text in ("+x  +y +z", "+x,+y,+z", "+x +y +z ", "+w +y +z")),
    ],
)
def test_anything_else_is_refused_with_what_was_expected(text: str, reason: str) -> None:
    with pytest.raises(SettingError, match=reason):
        parse_mounting(text)
