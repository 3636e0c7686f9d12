"""The node's end of a run's ports: what no run says, instants as stamps, the pace of a topic."""

from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.links.ros2 import ports_end
from firmware_runtime.links.ros2.ports_end import CLOCK_SET, Pace, PortsEnd, Stamps
from tests.support.replies import Replies
from tests.support.waiting import wait_until

TIME = b'{"t_ns": 1, "monotonic_ns": 1}'


@pytest.mark.parametrize("said", [b"\xff", b"5", b'{"monotonic_ns": {}}'])
def test_what_is_not_understood_is_counted_and_said_and_reading_goes_on(
    tmp_path: Path, said: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ports_end, "TIME_EVERY", 10 * MILLISECOND)
    logged: list[str] = []
    with Replies(tmp_path / "robot.stats") as run:
        end = PortsEnd(run.path, ["said"], lambda *_: None, logged.append)
        end.begin(lambda _: NEVER)
        run.answer_bytes(said)
        run.answer_bytes(TIME)
        wait_until(lambda: any("watch" in each for each in run.requests()), "it reads on")
        end.close()
    assert end.counts["failed"] == 1
    [sentence] = logged
    assert "not understood" in sentence


# Instants of a run as instants of ROS -------------------------------------------------------------

TO_SYSTEM = 1_700_000_000 * SECOND


def test_an_instant_is_placed_by_what_the_run_said_of_its_time() -> None:
    stamps = Stamps()
    assert not stamps.is_known
    stamps.measure(2 * SECOND, 100 * SECOND, TO_SYSTEM)
    assert stamps.is_known
    assert stamps.of("a", 2 * SECOND) == TO_SYSTEM + 100 * SECOND
    assert stamps.of("a", 3 * SECOND) == TO_SYSTEM + 101 * SECOND


def test_a_small_step_back_of_the_system_clock_does_not_turn_stamps_back() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    first = stamps.of("a", SECOND)
    stamps.measure(SECOND, SECOND, TO_SYSTEM - 5 * MILLISECOND)
    assert stamps.of("a", SECOND + MILLISECOND) == first
    assert stamps.of("b", SECOND) == first - 5 * MILLISECOND
    assert stamps.of("a", SECOND + 6 * MILLISECOND) == first + MILLISECOND


def test_a_clock_that_was_set_is_followed() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    first = stamps.of("a", SECOND)
    stamps.measure(SECOND, SECOND, TO_SYSTEM - 2 * CLOCK_SET)
    assert stamps.of("a", SECOND) == first - 2 * CLOCK_SET


def test_the_pace_of_scaled_time_is_found() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    stamps.measure(10 * SECOND, SECOND, TO_SYSTEM)
    assert stamps.of("a", 20 * SECOND) == TO_SYSTEM + 2 * SECOND


def test_the_next_run_begins_again() -> None:
    stamps = Stamps()
    stamps.measure(50 * SECOND, 60 * SECOND, TO_SYSTEM)
    stamps.forget()
    assert not stamps.is_known
    stamps.measure(SECOND, 100 * SECOND, TO_SYSTEM)
    assert stamps.of("a", 2 * SECOND) == TO_SYSTEM + 101 * SECOND


# How often a topic is published -------------------------------------------------------------------


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
