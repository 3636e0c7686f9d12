"""Starts that fail one after the other: how they are counted, and when they are forgotten."""

import json
from pathlib import Path
from time import monotonic_ns

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import SECOND
from firmware_runtime.runs import restarts
from firmware_runtime.runs.restarts import (
    FIRST_PAUSE,
    FORGOTTEN_AFTER,
    HEALTHY_AFTER,
    LONGEST_PAUSE,
    Restarts,
    pause_after,
    read_starts,
)
from firmware_runtime.statistics.paths import Companion


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "state" / "tachobot.stats"


def failing(statistics: Path, starts: int) -> Restarts:
    """The last of so many starts, none of which was forgotten."""
    for _ in range(starts):
        last = Restarts(statistics)
        last.begin()
    return last


def test_pauses_double_from_half_a_second_to_thirty() -> None:
    pauses = [pause_after(failed) / SECOND for failed in range(9)]
    assert pauses == [0.5, 0.5, 1, 2, 4, 8, 16, 30, 30]


@given(st.integers(0, 10**9))
def test_no_pause_is_outside_of_these(failed: int) -> None:
    assert FIRST_PAUSE <= pause_after(failed) <= LONGEST_PAUSE
    assert pause_after(failed + 1) >= pause_after(failed)


def test_the_first_start_and_the_one_after_one_failure_wait_no_longer_than_systemd(
    statistics: Path,
) -> None:
    waits = [failing(statistics, 1).wait / SECOND for _ in range(5)]
    assert waits == [0, 0, 0.5, 1.5, 3.5]


def test_what_a_start_left_is_read_by_others(statistics: Path) -> None:
    assert read_starts(statistics) is None
    failing(statistics, 3)
    starts = read_starts(statistics)
    assert starts is not None
    assert starts.failed == 2
    assert Companion.STARTS.beside(statistics).stat().st_mode & 0o777 == 0o640


def test_a_run_that_lasted_a_minute_begins_the_count_again(statistics: Path) -> None:
    last = failing(statistics, 5)
    last.between_steps(HEALTHY_AFTER - 1, SECOND)
    last.between_steps(HEALTHY_AFTER, 0)
    assert Companion.STARTS.beside(statistics).exists()
    last.between_steps(HEALTHY_AFTER + 1, SECOND)
    assert Restarts(statistics).failed == 0


def test_a_loop_that_never_has_time_is_forgotten_all_the_same(statistics: Path) -> None:
    last = failing(statistics, 2)
    last.between_steps(HEALTHY_AFTER + SECOND, 0)
    assert Restarts(statistics).failed == 0


def test_a_start_of_long_ago_says_nothing(
    statistics: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing(statistics, 3)
    later = monotonic_ns() + FORGOTTEN_AFTER + SECOND
    monkeypatch.setattr(restarts, "monotonic_ns", lambda: later)
    assert Restarts(statistics).failed == 0


def test_starts_of_another_boot_do_not_count(statistics: Path) -> None:
    failing(statistics, 3)
    path = Companion.STARTS.beside(statistics)
    kept = json.loads(path.read_text())
    path.write_text(json.dumps({**kept, "boot_id": "another"}))
    assert Restarts(statistics).failed == 0
    path.write_text(json.dumps({**kept, "at_ns": 1 << 62}))
    assert Restarts(statistics).failed == 0


def test_a_service_that_cannot_see_which_boot_it_is_counts_all_the_same(statistics: Path) -> None:
    failing(statistics, 3)
    path = Companion.STARTS.beside(statistics)
    path.write_text(json.dumps({**json.loads(path.read_text()), "boot_id": ""}))
    assert Restarts(statistics).failed == 3


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b"\xff", b"[" * 3000, b'{"failed": -1}'])
def test_what_is_no_such_file_is_none(statistics: Path, content: bytes) -> None:
    statistics.parent.mkdir()
    Companion.STARTS.beside(statistics).write_bytes(content)
    assert Restarts(statistics).failed == 0
