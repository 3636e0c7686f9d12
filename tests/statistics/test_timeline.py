"""The timeline: what it keeps of a run, and for how long."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.histogram import empty_cells
from firmware_runtime.statistics.history import COUNTED, Timeline, read_timeline
from firmware_runtime.statistics.layout import TIMELINE, WIDTHS


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
