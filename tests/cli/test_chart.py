"""The chart in plain text that a run prints."""

import pytest

from firmware_runtime.cli.chart import chart
from firmware_runtime.devs.time import MICROSECOND, SECOND


@pytest.mark.parametrize(
    ("until", "shown"),
    [(10 * SECOND, "10 s"), (10 * SECOND + 1500 * MICROSECOND, "10 s"), (SECOND // 2, "0.5 s")],
)
def test_the_end_of_the_time_axis_is_in_hundredths_of_a_second(until: int, shown: str) -> None:
    assert chart([(0, 0.0), (until, 1.0)], "label", until)[-1].split("  ")[-1].strip() == shown
