"""Conditions, dates, takeovers and the timeline of a run."""

from itertools import count, pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import asdict, replace

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox import keyframe_schedule, recorder
from firmware_runtime.recording.blackbox.listing import listed
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.file_header import Conditions, RunFigures, conditions_of
from firmware_runtime.statistics.histogram import empty_cells
from firmware_runtime.statistics.history import COUNTED, Timeline, read_timeline
from firmware_runtime.statistics.layout import SLOTS, TIMELINE, WIDTHS
from firmware_runtime.statistics.number_formats import NO_DATES, STEP, Dates, local, local_of, utc
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.summary import refusals
from firmware_runtime.statistics.takeovers import (
    KEPT,
    Takeover,
    note_takeover,
    read_takeovers,
    takeovers_of,
)
from firmware_runtime.system.this_process import ProcessIdentity

RUN = RunFigures(
    state="running",
    reason=None,
    complete=True,
    elapsed_s=5.0,
    steps=1,
    inputs_dropped=0,
    overloaded_s=None,
    armed=False,
    guarded=False,
    cpu_s=None,
)
FIFO = {"asked": 60, "granted": True, "reason": None}
GRANTED = {
    "scheduler": "SCHED_FIFO",
    "scheduler_priority": 60,
    "settings": {"fifo_priority": FIFO},
}


def held(stated: dict[str, Any], yielded_ns: int = 0) -> Conditions:
    return conditions_of(stated, RUN, yielded_ns)


def test_what_holds_is_stated_as_it_is() -> None:
    now = held(GRANTED)
    run = asdict(RUN)
    assert run.pop("began_ns") is None
    assert now.as_json() == {**GRANTED, "run": run}
    assert list(refusals(now.settings)) == []
    assert now.refused == {}


def test_priority_that_was_given_up_is_not_granted_any_more() -> None:
    now = held(GRANTED, 3 * SECOND)
    assert list(refusals(now.settings)) == [
        "not granted: fifo_priority = 60 (given up after 3.0 s: overload)"
    ]
    assert (now.text("scheduler"), now.stated["scheduler_priority"]) == ("SCHED_OTHER", 0)
    assert FIFO["granted"]


def test_a_run_without_priority_has_none_to_give_up() -> None:
    settings = {"fifo_priority": {"asked": 60, "granted": False, "reason": "EPERM"}}
    assert held({"settings": settings}, SECOND) == held({"settings": settings})
    assert held({}, SECOND) == held({})


def test_what_was_not_requested_is_not_refused() -> None:
    settings = {"spin_us": {"asked": 0.0, "granted": False, "reason": "not asked for"}}
    assert held({"settings": settings}).refused == {}


def test_what_is_not_known_has_no_text() -> None:
    now = held({"governor": None, "cpu_count": 4})
    assert (now.text("governor"), now.text("kernel"), now.text("cpu_count")) == (None, None, "4")


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
    assert dates.of(5 * SECOND - 1) == DATE + 5 * SECOND - 1
    for at in (5 * SECOND, 6 * SECOND):
        assert dates.of(at) == DATE + at + HOUR
    assert dates.of(10 * SECOND) == DATE + 10 * SECOND


def test_what_a_program_was_told_can_be_said_to_people() -> None:
    dates = Dates(DATE, [], 1.0)
    assert dates.as_json(SECOND) == {"date": utc(DATE + SECOND)}
    assert local_of(utc(DATE)) == local(DATE)
    assert NO_DATES.as_json(SECOND) == {}


@pytest.mark.parametrize(("speed", "passed"), [(0.0, 8), (1.0, 8), (2.0, 4), (0.5, 16)])
def test_a_clock_that_is_faster_takes_less_time(speed: float, passed: int) -> None:
    assert Dates(DATE, [], speed).of(8 * SECOND) == DATE + passed * SECOND
    assert Dates(None, [(8 * SECOND, DATE)], speed).of(0) == DATE - passed * SECOND


def test_no_date_is_said_where_none_is_known() -> None:
    for strange in ([], [(-1, DATE)], [(0, -1)], [(0, 1 << 63)]):
        dates = Dates(None, strange, 1.0)
        assert (dates.of(0), dates.said(SECOND)) == (None, "")
    assert Dates(None, [(0, 0)], 1.0).of(SECOND) == SECOND  # a computer without a clock of its own


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


WRITER = ProcessIdentity(4711, 12, "a")


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


def takeover(at_ns: int, off_after_ns: int | None = 2_500_000) -> Takeover:
    return Takeover(at_ns, WRITER, 1, "process 4711 has ended", off_after_ns)


def test_what_was_written_is_read_by_the_next_guard_too(statistics: Path) -> None:
    note_takeover(statistics, takeover(1))
    note_takeover(statistics, takeover(2))
    assert read_takeovers(statistics) == [takeover(1), takeover(2)]


def test_the_same_takeover_is_replaced_by_how_it_went_on(statistics: Path) -> None:
    note_takeover(statistics, takeover(1, None))
    note_takeover(statistics, takeover(2, None))  # another guard's
    note_takeover(statistics, takeover(1))
    assert read_takeovers(statistics) == [takeover(1), takeover(2, None)]


def test_only_the_last_are_kept(statistics: Path) -> None:
    for at in range(KEPT + 5):
        note_takeover(statistics, takeover(at))
    assert [each.at_ns for each in read_takeovers(statistics)] == list(range(5, KEPT + 5))


def test_another_process_has_its_own(statistics: Path) -> None:
    note_takeover(statistics, takeover(1))
    assert takeovers_of(statistics, WRITER) == [takeover(1)]
    assert takeovers_of(statistics, replace(WRITER, started_ticks=13)) == []


DEEP = b'{"at_ns": 1, "writer": ' + b'{"a":' * 3000 + b"1" + b"}" * 3001


@pytest.mark.parametrize("content", [None, b"", b"{", b"[1]\n", b"\xff\xfe\n", DEEP])
def test_a_file_of_another_format_holds_none_and_is_replaced(
    statistics: Path, content: bytes | None
) -> None:
    if content is not None:
        Companion.TAKEOVERS.beside(statistics).write_bytes(content)
    assert read_takeovers(statistics) == []
    note_takeover(statistics, takeover(1))
    assert read_takeovers(statistics) == [takeover(1)]


def test_a_takeover_reads_as_a_sentence() -> None:
    assert takeover(1).text() == "process 4711 has ended; all outputs off after 2.5 ms"
    failing = takeover(1, None)
    failing.failed = ["i2c1 0x40: not acknowledged"]
    assert failing.text() == (
        "process 4711 has ended; outputs not off: i2c1 0x40: not acknowledged"
    )


class Counted:
    """A run that counts one activation at each instant given, and writes its timeline."""

    def __init__(self) -> None:
        self.cells = empty_cells(TIMELINE)
        self.counters = [0] * len(COUNTED)
        self.timeline = Timeline(self.cells, lambda: self.counters)

    def step(self, at: int, lateness: int = 0) -> None:
        if at >= self.timeline.closes_at:
            self.timeline.close(at)
        self.counters[COUNTED.index("activations")] += 1
        self.counters[COUNTED.index("lateness_ns")] += lateness
        self.timeline.lateness_max = max(self.timeline.lateness_max, lateness)


def test_a_span_holds_what_was_counted_in_its_second() -> None:
    run = Counted()
    for tenth in range(25):
        run.step(tenth * SECOND // 10, lateness=tenth)
    run.timeline.close(25 * SECOND // 10)
    spans = read_timeline(run.cells)
    assert [(span.begin_ns, span.activations) for span in spans] == [
        (0, 10),
        (SECOND, 10),
        (2 * SECOND, 5),
    ]
    assert [span.lateness_max_ns for span in spans] == [9, 19, 24]
    assert [span.lateness_ns for span in spans] == [45, 145, 110]


def test_what_is_older_than_two_minutes_is_kept_by_a_quarter_of_a_minute() -> None:
    run = Counted()
    for second in range(200):
        run.step(second * SECOND, lateness=second)
    run.timeline.close(200 * SECOND)
    spans = read_timeline(run.cells)
    assert spans[0].width_ns == 15 * SECOND
    assert spans[0].activations == 15
    assert spans[0].lateness_max_ns == 14
    assert spans[-1].width_ns == SECOND
    assert sum(span.activations for span in spans) == 200


def test_a_second_without_a_step_is_left_out() -> None:
    run = Counted()
    run.step(0)
    run.step(5 * SECOND + 1)
    run.timeline.close(6 * SECOND)
    assert [span.begin_ns for span in read_timeline(run.cells)] == [0, 5 * SECOND]


def test_a_ring_passed_over_does_not_show_spans_of_a_round_ago() -> None:
    run = Counted()
    run.step(7 * SECOND)
    run.step(500 * SECOND)
    run.timeline.close(501 * SECOND)
    spans = read_timeline(run.cells)
    assert [(span.begin_ns, span.width_ns) for span in spans if span.activations == 1] == [
        (0, 15 * SECOND),
        (495 * SECOND, 15 * SECOND),
    ]


def test_of_the_last_seconds_those_passed_over_do_not_count_what_was_a_round_ago() -> None:
    run = Counted()
    for at in (7, 126, 128):
        run.step(at * SECOND, lateness=at)
    lately = run.timeline.lately(125 * SECOND)
    assert (lately.begin_ns, lately.activations) == (126 * SECOND, 2)
    assert lately.lateness_max_ns == 128


def test_spans_reach_back_minutes_half_an_hour_a_working_day_and_days() -> None:
    assert [SLOTS * width // SECOND for width in WIDTHS] == [120, 1800, 8 * 3600, 5 * 24 * 3600]
    assert all(wide % narrow == 0 for narrow, wide in pairwise(WIDTHS))


@given(st.lists(st.integers(1, 400 * SECOND), min_size=1, max_size=60))
def test_spans_do_not_overlap_and_none_counts_twice(gaps: list[int]) -> None:
    run, at = Counted(), 0
    for gap in gaps:
        at += gap
        run.step(at)
    run.timeline.close(at)
    spans = read_timeline(run.cells)
    for earlier, later in pairwise(spans):
        assert earlier.begin_ns + earlier.width_ns <= later.begin_ns
    assert sum(span.activations for span in spans) <= len(gaps)
    if at < WIDTHS[-1]:
        assert sum(span.activations for span in spans) == len(gaps)
