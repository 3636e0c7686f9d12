import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND, format_time, seconds


def test_ten_and_twenty_milliseconds_are_thirty() -> None:
    assert seconds(0.010) + seconds(0.020) == seconds(0.030) == 30 * MILLISECOND


@pytest.mark.parametrize(
    ("value", "nanoseconds"),
    [(0, 0), (1e-9, 1), (0.4e-9, 0), (1e-6, MICROSECOND), (2, 2 * SECOND), (-0.5, -SECOND // 2)],
)
def test_seconds_become_the_nearest_nanosecond(value: float, nanoseconds: int) -> None:
    assert seconds(value) == nanoseconds
    assert type(seconds(value)) is int


@pytest.mark.parametrize(
    ("at", "text"),
    [
        (0, "0.000000000 s"),
        (1, "0.000000001 s"),
        (SECOND + 5 * MILLISECOND, "1.005000000 s"),
        (NEVER, "never"),
    ],
)
def test_an_instant_reads_as_seconds(at: int, text: str) -> None:
    assert format_time(at) == text


@given(st.integers(0, NEVER - 1))
def test_a_formatted_instant_loses_nothing(at: int) -> None:
    whole, _, rest = format_time(at).removesuffix(" s").partition(".")
    assert int(whole) * SECOND + int(rest) == at


def test_never_is_later_than_any_instant_of_two_centuries() -> None:
    assert NEVER > 200 * 365 * 24 * 3600 * SECOND
