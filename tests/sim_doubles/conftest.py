"""What the doubles' tests share: a clock moved by hand."""

import pytest

from sim_doubles.clock import ManualClock


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()
