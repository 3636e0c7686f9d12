"""A run has a date, also where the system's clock is set while it goes on."""

from itertools import count
from pathlib import Path

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox import keyframe_schedule, recorder
from firmware_runtime.recording.blackbox.listing import listed
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.number_formats import NO_DATES, STEP, Dates, local, local_of, utc
from firmware_runtime.statistics.reader import read_statistics

HOUR = 3600 * SECOND
DATE = 1_795_654_594_221_886_600


def test_what_is_between_two_pairs_follows_from_the_first() -> None:
    dates = Dates(DATE, [(SECOND, DATE), (9 * SECOND, DATE + 8 * SECOND + STEP // 2)], 1.0)
    assert dates.pairs == [(0, DATE - SECOND)]
    assert dates.of(5 * SECOND) == DATE + 4 * SECOND


def test_a_clock_that_is_set_counts_from_there_on() -> None:
    noted = [(0, DATE), (5 * SECOND, DATE + 5 * SECOND + HOUR), (9 * SECOND, DATE + 9 * SECOND)]
    dates = Dates(None, noted, 1.0)
    assert dates.of(4 * SECOND) == DATE + 4 * SECOND
    assert dates.of(6 * SECOND) == DATE + 6 * SECOND + HOUR
    assert dates.of(10 * SECOND) == DATE + 10 * SECOND


def test_what_a_program_was_told_can_be_said_to_people() -> None:
    dates = Dates(DATE, [], 1.0)
    assert dates.as_json(SECOND) == {"date": utc(DATE + SECOND)}
    assert local_of(utc(DATE)) == local(DATE)
    assert NO_DATES.as_json(SECOND) == {}


@pytest.mark.parametrize(("speed", "passed"), [(0.0, 8), (1.0, 8), (2.0, 4), (0.5, 16)])
def test_a_clock_that_is_faster_takes_less_time(speed: float, passed: int) -> None:
    assert Dates(DATE, [], speed).of(8 * SECOND) == DATE + passed * SECOND


def test_no_date_is_said_where_none_is_known() -> None:
    for strange in ([], [(-1, DATE)], [(0, -1)], [(0, 1 << 63)]):
        dates = Dates(None, strange, 1.0)
        assert (dates.of(0), dates.said(SECOND)) == (None, "")


def test_dates_for_programs_and_for_people() -> None:
    assert utc(DATE) == "2026-11-26T00:56:34.221886600Z"
    assert local(DATE)[-18:-5].endswith(":34.221")


@pytest.mark.real_time
@pytest.mark.slow
def test_a_run_notes_that_the_systems_clock_was_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keyframe_schedule, "KEYFRAME_EVERY", 50 * MILLISECOND)
    dates = count(DATE, HOUR)
    monkeypatch.setattr(recorder, "time_ns", lambda: next(dates))
    path, kept = tmp_path / "x.recording", tmp_path / "x.stats"
    board = board_in_force("tachobot", ("recording.minutes=0.1",))
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=kept, recording=path
    )
    try:
        session.run(SECOND // 2)
    finally:
        session.close()
    found = read_recording(path).dates()
    assert len(found.pairs) > 1
    assert {round(date - DATE, -11) % HOUR for _, date in found.pairs} == {0}
    began = read_statistics(kept).figures().conditions.run.began_ns
    assert began is not None
    assert listed(path).began == found.of(0)
