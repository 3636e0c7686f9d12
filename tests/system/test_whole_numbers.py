"""Whole numbers in texts: those that are one, and all that only look like one."""

import pytest

from firmware_runtime.system.whole_numbers import whole_number


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("0", 0),
        ("65535", 65535),
        ("000000000000000000000000000080", 80),
        ("65536", None),
        ("100000", None),
        ("", None),
        ("-1", None),
        ("+1", None),
        ("1.0", None),
        (" 1", None),
        ("1_0", None),
        ("²", None),
        ("٣", None),
        ("9" * 5000, None),
    ],
)
def test_a_whole_number_is_ascii_digits_up_to_the_most(text: str, number: int | None) -> None:
    assert whole_number(text, 65535) == number
