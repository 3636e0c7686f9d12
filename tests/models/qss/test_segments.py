import pytest

from firmware_runtime.models.qss import Segment

SEGMENT = Segment(1.0, -2.0, 3.0, 4.0)


def test_the_value_of_a_segment_is_that_of_its_polynomial() -> None:
    assert [SEGMENT.at(seconds) for seconds in (0.0, 0.5, 2.0)] == [1.0, 1.25, 41.0]


def test_a_segment_that_begins_later_is_the_same_polynomial() -> None:
    later = SEGMENT.after(0.5)
    for seconds in (-0.5, 0.0, 1.0):
        assert later.at(seconds) == pytest.approx(SEGMENT.at(0.5 + seconds))
