"""The chart in plain text that a run prints."""

import pytest

from firmware_runtime.cli.terminal_chart import chart
from firmware_runtime.devs.time import MICROSECOND, SECOND


@pytest.mark.parametrize(
    ("until", "shown"),
    [(10 * SECOND, "10 s"), (10 * SECOND + 1500 * MICROSECOND, "10 s"), (SECOND // 2, "0.5 s")],
)
def test_the_end_of_the_time_axis_is_in_hundredths_of_a_second(until: int, shown: str) -> None:
    assert chart([(0, 0.0), (until, 1.0)], "label", until)[-1].split("  ")[-1].strip() == shown


def test_a_small_scale_is_not_zero_at_both_ends() -> None:
    lines = chart([(0, -2e-5), (SECOND, 1e-5)], "label", SECOND)
    assert [line.split()[0] for line in (lines[1], lines[8])] == ["1e-05", "-2e-05"]
    assert len({line.index("┤") for line in lines[1:9]}) == 1


def test_values_below_zero_have_zero_on_their_scale_as_those_above_it() -> None:
    lines = chart([(0, -0.2), (SECOND, -0.2 - 1e-9)], "label", SECOND)
    assert [line.split()[0] for line in (lines[1], lines[8])] == ["0.000", "-0.200"]
