"""Faults by their kinds: which leave no doubt, and what cannot be made, each in a sentence."""

import pytest

from firmware_runtime import ConfigError, Strike, open_board
from firmware_runtime.hal.strike import KINDS


@pytest.mark.parametrize(
    ("kind", "leaves_no_doubt"),
    [
        ("nack", True),
        ("silent", True),
        ("absent", True),
        ("brown-out", True),
        ("freeze", False),
        ("weak", False),
        ("push", False),
    ],
)
def test_what_fails_leaves_no_doubt_and_what_lies_does(kind: str, *, leaves_no_doubt: bool) -> None:
    assert KINDS[kind].leaves_no_doubt is leaves_no_doubt


def test_of_a_script_all_that_cannot_be_made_is_refused_and_nothing_is_run() -> None:
    faults = [Strike("nack", "nobody", at_s=1.0), Strike("nack", "imu"), Strike("drop", "imu")]
    with pytest.raises(ConfigError) as caught:
        open_board("tachobot", doubles=True, clock="virtual", faults=faults)
    first, second = caught.value.faults
    assert first.startswith("fault: ")
    assert "nobody" in first
    assert "drop" in second
