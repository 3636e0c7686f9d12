"""The clock tests move by hand."""

import pytest

from sim_doubles.clock import ManualClock


def test_manual_clock_stands_still_until_advanced() -> None:
    clock = ManualClock(5)
    assert clock() == 5
    clock.advance(20)
    clock.advance(0)
    assert clock() == 25


def test_manual_clock_does_not_go_back() -> None:
    with pytest.raises(ValueError, match="advanced by -1 ns"):
        ManualClock().advance(-1)
