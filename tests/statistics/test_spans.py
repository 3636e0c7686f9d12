"""The flight recorder's file: whole entries only, the latest of them."""

import os
from pathlib import Path

import pytest

from firmware_runtime.statistics import spans
from firmware_runtime.statistics.errors import StatisticsFileError
from firmware_runtime.statistics.spans import MODELS, STEP, Recorded, SpanRing, read_spans


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.spans"


def test_what_is_recorded_is_read_in_order(path: Path) -> None:
    ring = SpanRing(["imu"], 8, path)
    ring.record(MODELS, 10, 30)
    ring.record(STEP, 5, 40)
    assert read_spans(path) == [Recorded("imu", 10, 30), Recorded("step", 5, 40)]


def test_the_latest_stay_when_the_ring_is_full(path: Path) -> None:
    ring = SpanRing(["imu"], 8, path)
    for at in range(100):
        ring.record(MODELS, at, at + 1)
    assert [each.begin_ns for each in read_spans(path)] == list(range(92, 100))


def test_an_entry_overwritten_while_it_was_copied_is_left_out(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ring = SpanRing(["imu"], 4, path)
    for at in range(4):
        ring.record(MODELS, at, at)
    monkeypatch.setattr(spans, "settle", lambda: ring.record(MODELS, 9, 9))
    assert [each.begin_ns for each in read_spans(path)] == [1, 2, 3]


def test_a_file_cut_short_is_refused(path: Path) -> None:
    SpanRing(["imu"], 4, path)
    os.truncate(path, path.stat().st_size - 8)
    with pytest.raises(StatisticsFileError, match="not a whole flight recorder's file"):
        read_spans(path)


def test_no_file_is_one_sentence(path: Path) -> None:
    with pytest.raises(StatisticsFileError, match="flight recorder's file cannot be read"):
        read_spans(path)


def test_an_entry_of_an_unknown_track_is_refused(path: Path) -> None:
    SpanRing(["imu"], 4, path).record(9, 1, 2)
    with pytest.raises(StatisticsFileError, match="track"):
        read_spans(path)
