"""How often a topic is published, on a clock of the test's own."""

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.links.ros2.pace import Pace


def published(pace: Pace[int], every_ms: int, count: int, jitter_ms: int = 0) -> list[int]:
    """Which messages go out, if one comes each `every_ms`, some of them late."""
    out: list[int | None] = []
    for number in range(count):
        t_ns = number * every_ms * MILLISECOND
        now = t_ns + number % 3 * jitter_ms * MILLISECOND
        out += [pace.late(now), pace.take(number, t_ns, now)]
    return [each for each in out if each is not None]


@pytest.mark.parametrize("jitter_ms", [0, 4])
def test_every_second_message_of_100_hz_goes_out_at_50_hz(jitter_ms: int) -> None:
    assert published(Pace(50.0), 10, 11, jitter_ms) == [0, 2, 4, 6, 8, 10]


@pytest.mark.parametrize("rate_hz", [7.0, 30.0, 60.0])
def test_the_mean_rate_is_the_stated_one(rate_hz: float) -> None:
    out = published(Pace(rate_hz), 10, 1001)
    assert len(out) == pytest.approx(rate_hz * 10, abs=2)
    assert out == sorted(set(out))


def test_a_rate_of_zero_lets_everything_through_at_once() -> None:
    pace: Pace[int] = Pace(0.0)
    assert [pace.take(number, 5, 5) for number in range(20)] == list(range(20))
    assert pace.due_at == NEVER


def test_the_last_message_goes_out_though_no_other_follows() -> None:
    pace: Pace[str] = Pace(10.0)
    assert pace.take("first", 0, 7) == "first"
    assert pace.take("second", MILLISECOND, MILLISECOND + 7) is None
    assert pace.take("third", 2 * MILLISECOND, 2 * MILLISECOND + 7) is None
    due_at = pace.due_at
    assert 100 * MILLISECOND <= due_at <= 300 * MILLISECOND
    assert pace.late(due_at - 1) is None
    assert pace.late(due_at) == "third"
    assert pace.late(due_at + SECOND) is None


def test_after_a_pause_there_is_no_burst() -> None:
    pace: Pace[int] = Pace(10.0)
    out = [pace.take(number, 10**12 + number, 0) for number in range(5)]
    assert [each for each in out if each is not None] == [0]


def test_a_run_that_begins_again_is_published_at_once() -> None:
    pace: Pace[int] = Pace(10.0)
    assert pace.take(1, 500 * SECOND, 0) == 1
    assert pace.take(2, 0, 0) == 2
    assert pace.take(3, SECOND // 20, 0) is None
    assert pace.take(4, SECOND // 10, 0) == 4
