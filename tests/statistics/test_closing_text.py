"""The last lines of a run: twelve at most, in a fixed order, nothing claimed that is not known."""

from typing import Any

import pytest
from msgspec import convert
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics.blame import ABOUT, Blame, Cause
from firmware_runtime.statistics.closing_text import (
    MOST,
    closing_lines,
    did_text,
    next_text,
    outputs_text,
    punctuality,
    stopped_text,
    went_wrong,
)
from firmware_runtime.statistics.figures import (
    Causes,
    FaultFigures,
    Figures,
    LinkFigures,
    WorstActivation,
    figures_from,
)
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.statistics.number_formats import (
    local,
    microseconds,
    milliseconds,
    three_digits,
)
from firmware_runtime.statistics.rows import DeadlineRow
from firmware_runtime.statistics.run_text import causes_text, link_text, statistics_text
from tests.support.written_run import WrittenRun

LATE = (0.1, 13.0)
DATE = 1_795_654_594_221_886_600
REFUSED = "not granted: fifo_priority = 60 (Operation not permitted; needs CAP_SYS_NICE)"


def run_of(*lateness_ms: float, skipped: int = 0, **conditions: Any) -> Figures:  # noqa: ANN401 -- as JSON has them
    """A tick each 10 ms, so many ms late; beside the first, some that were skipped."""
    run = WrittenRun(**conditions)
    for number, late in enumerate(lateness_ms):
        at = number * 10 * MILLISECOND
        run.activation(at, round(late * MILLISECOND), 0, skipped=0 if number else skipped)
    return run.statistics(RunState.ENDED).figures()


def worst(lateness_us: float, cause: str | None, culprit: str | None = None) -> WorstActivation:
    blame = None if cause is None else Blame(cause, culprit, 0.0, 0.0, {})
    return WorstActivation(0, "imu", lateness_us, 0.0, Causes(0.0, 0.0, 0.0, {}, {}), blame)


@pytest.mark.parametrize(
    ("lateness_ms", "skipped", "said"),
    [
        ((0.1, 0.4), 0, "all 2 ticks on time, within 0.4 ms"),
        ((0.1,) * 1001 + LATE[1:] * 2, 2, "1,001 of 1,005 ticks on time; the worst 13 ms late"),
        ((0.1,), 1, "1 of 2 ticks on time; 1 did not run"),
        ((), 0, "no tick of its own; 0 reactions to inputs"),
    ],
)
def test_it_says_how_many_ticks_were_on_time(
    lateness_ms: tuple[float, ...], skipped: int, said: str
) -> None:
    assert punctuality(run_of(*lateness_ms, skipped=skipped)) == said


@pytest.mark.parametrize(("ticks", "steps"), [((), 0), ((), 1), ((0.1,), 0), ((0.1,), 5)])
def test_a_run_of_reactions_alone_has_begun_too(ticks: tuple[float, ...], steps: int) -> None:
    figures = run_of(*ticks)
    run = replace(figures.conditions.run, steps=steps)
    figures = replace(figures, conditions=replace(figures.conditions, run=run))
    assert figures.has_begun is (ticks != () or steps > 0)


def test_the_latest_has_its_cause_and_who_it_was_in_words() -> None:
    longest, latest = worst(5_000.0, Cause.GARBAGE), worst(13_000.0, Cause.BUS, "i2c1 0x68")
    found = replace(run_of(*LATE), worst=[longest, latest])
    assert punctuality(found).endswith(f"the worst 13 ms late: {ABOUT[Cause.BUS]} (i2c1 0x68)")
    assert punctuality(replace(found, worst=[worst(13_000.0, None)])).endswith("ms late")
    of_a_newer_file = replace(found, worst=[worst(13_000.0, "sunspots")])
    assert punctuality(of_a_newer_file).endswith("ms late: sunspots")


def test_all_statistics_say_first_how_it_ended_and_a_long_span_to_the_millisecond() -> None:
    assert statistics_text(run_of(0.1))[1].startswith("ended after ")
    assert milliseconds(12_345_600.0) == "12346 ms"


@pytest.mark.parametrize(
    ("us", "said"),
    [
        (None, "-"),
        (46.07, "46.1 us"),
        (999.0, "999.0 us"),
        (1e3, "1.00 ms"),
        (999_000.0, "999.00 ms"),
        (1e6, "1.00 s"),
    ],
)
def test_a_span_in_a_terminal_is_said_in_the_largest_unit_that_fits(
    us: float | None, said: str
) -> None:
    assert microseconds(us) == said


@pytest.mark.parametrize(
    ("us", "said"),
    [
        (None, "-"),
        (46.07, "46.1 us"),
        (999.4, "999 us"),
        (999.5, "1 ms"),
        (999_500.0, "1 s"),
        (5e9, "5e+03 s"),
    ],
)
def test_a_span_in_a_narrow_column_has_three_digits(us: float | None, said: str) -> None:
    assert three_digits(us) == said


@pytest.mark.parametrize(
    ("state", "reason", "said"),
    [
        ("running", None, "has run for 0.00 s"),
        ("ended", "the run reached 1.0 s", "ended after 0.00 s"),
        ("stopped", "SIGINT", "stopped (SIGINT) after 0.00 s"),
        ("died", None, "died after 0.00 s"),
    ],
)
def test_a_run_that_ended_before_its_time_says_why(
    state: str, reason: str | None, said: str
) -> None:
    figures = run_of(0.1)
    run = replace(figures.conditions.run, state=state, reason=reason)
    figures = replace(figures, conditions=replace(figures.conditions, run=run))
    assert statistics_text(figures)[1].partition(":")[0] == said


def test_each_model_has_a_row_of_its_own_time_above_that_of_the_whole_step() -> None:
    lines = statistics_text(run_of(0.1))
    head = next(number for number, line in enumerate(lines) if line.startswith("  time of"))
    rows = [line.split() for line in lines[head + 1 : head + 4]]
    assert [row[0] for row in rows] == ["imu", "compass", "whole"]
    assert rows[1][1:] == ["-"] * 5


@pytest.mark.parametrize(("clock", "is_dated"), [("MonotonicClock", True), ("ScaledClock", False)])
def test_the_worst_has_a_date_where_an_instant_of_the_run_has_one(
    clock: str, *, is_dated: bool
) -> None:
    figures = replace(run_of(0.1, clock=clock), worst=[worst(5_000.0, None)])
    run = replace(figures.conditions.run, began_ns=DATE)
    figures = replace(figures, conditions=replace(figures.conditions, run=run))
    (said,) = [each for each in statistics_text(figures) if "worst: " in each]
    assert (f" ({local(DATE)})," in said) is is_dated


WENT_WRONG = [
    *("1 silence", "refused key 1", "dropped 1", "overtaken 1", "given up 1"),
    "left while not connected 1",
]


@pytest.mark.parametrize("count", [0, 1])
def test_of_a_link_each_thing_that_went_wrong_is_said_from_the_first_on(count: int) -> None:
    none = dict.fromkeys(("sent", "repeated", "received", "unsent"), 0)
    wrong = dict.fromkeys(("dropped", "overtaken", "given_up", "unconnected", "silences"), count)
    times = {"age_us": Distribution(), "round_trip_us": Distribution()}
    counted = {"is_good": True, **none, **wrong, "refused": {"key": count}}
    link = convert({**counted, **times}, LinkFigures)
    said = link_text(link).partition("; sent 0")[0].split("; ")
    assert said == ["good", *WENT_WRONG[: 6 * count]]


def test_a_model_that_has_not_run_is_shown_with_none_of_its_activations() -> None:
    rows = [each.split()[:5] for each in statistics_text(run_of(0.1))]
    assert ["compass", "100", "Hz", "0", "-"] in rows


@pytest.mark.parametrize("began", [None, 1_700_000_000 * SECOND])
def test_when_a_run_began_is_said_where_it_is_known(began: int | None) -> None:
    figures = run_of(0.1)
    run = replace(figures.conditions.run, began_ns=began)
    figures = replace(figures, conditions=replace(figures.conditions, run=run))
    said = [each for each in statistics_text(figures) if each.startswith("  began")]
    assert said == ([] if began is None else [f"  began {local(began)}"])


def test_of_the_causes_of_late_steps_the_most_frequent_is_said_first() -> None:
    counted = {Cause.GARBAGE: 1, Cause.BUS: 7, Cause.DISK: 3}
    lines = statistics_text(replace(run_of(0.1), late_by_cause=counted))
    assert "  late steps by cause: bus 7, disk 3, garbage 1" in lines


@pytest.mark.parametrize(
    ("run", "reactions", "said"),
    [(0, 0, ["0", "-"]), (1, 0, ["1", "-"]), (1, 2, ["1", "2"]), (0, 2, ["-", "2"])],
)
def test_a_model_that_only_reacts_has_a_dash_for_activations_and_another_for_reactions(
    run: int, reactions: int, said: list[str]
) -> None:
    figures = run_of(0.1)
    models = dict(figures.models)
    models["imu"] = replace(models["imu"], run=run, reactions=reactions)
    rows = [each.split() for each in statistics_text(replace(figures, models=models))]
    (row,) = (each for each in rows if each[:3] == ["imu", "100", "Hz"])
    assert row[3:5] == said


@pytest.mark.parametrize(
    ("counted", "said"),
    [
        ({}, ""),
        ({"reactions": 1}, "; 1 reaction to inputs"),
        ({"reactions": 2}, "; 2 reactions to inputs"),
        ({"waiting": 1}, ", 1 waiting"),
    ],
)
def test_what_waits_and_what_was_answered_at_once_is_said_where_there_is_such_a_thing(
    counted: dict[str, int], said: str
) -> None:
    figures = run_of(0.1)
    imu = replace(figures.models["imu"], **counted)
    story = statistics_text(replace(figures, models={**figures.models, "imu": imu}))[1]
    assert story.endswith(f", 0 coalesced{said}; 0 overruns in 0 episodes")


def test_in_virtual_time_no_activation_can_be_late() -> None:
    found = run_of(0.0, clock="VirtualClock")
    assert punctuality(found) == "in virtual time: no activation can be late"


@pytest.mark.parametrize(
    ("on", "not_safe", "said"),
    [
        ({"wings": 0, "tail": 0}, False, "all outputs off"),
        ({"wings": 0, "tail": 2}, False, "outputs still on: tail 2"),
        ({"wings": 0, "tail": 2}, True, "outputs still on: tail 2"),
        ({}, False, "all outputs were switched off"),
        (None, False, "all outputs were switched off"),
        (None, True, "outputs may still be on: not all could be switched off"),
    ],
)
def test_outputs_are_off_or_named(on: dict[str, int] | None, said: str, *, not_safe: bool) -> None:
    assert outputs_text(on, not_safe=not_safe) == said


def test_nothing_is_said_to_be_wrong_where_nothing_was() -> None:
    assert list(went_wrong(run_of(0.1))) == [], "a refused setting that had no effect is none"


@pytest.mark.parametrize(
    ("lateness_ms", "conditions", "drives_outside", "is_said"),
    [
        (LATE, {}, False, True),
        ((0.1,), {}, True, True),
        ((0.1,), {}, False, False),
        (LATE, {"clock": "VirtualClock"}, True, False),
    ],
    ids=["late", "on chips", "on time", "in virtual time"],
)
def test_a_refused_setting_counts_where_it_may_matter(
    lateness_ms: tuple[float, ...],
    conditions: dict[str, Any],
    *,
    drives_outside: bool,
    is_said: bool,
) -> None:
    found = run_of(*lateness_ms, **conditions)
    said = [each for each in went_wrong(found, drives_outside=drives_outside) if "granted" in each]
    assert [each.startswith(REFUSED) for each in said] == [True] * is_said


def test_faults_have_their_sentence_and_first_time_and_come_before_what_is_less_grave() -> None:
    fault = FaultFigures(3, 1.0, 2.5, "i2c1 0x68: not acknowledged")
    found = replace(
        run_of(*LATE),
        faults={"imu": {"NoAcknowledge": fault}},
        deadlines={"imu.sample -> thrust": DeadlineRow(3, 5, 2)},
    )
    first, second, third = went_wrong(found)
    said = "fault: imu NoAcknowledge 3 times from 1.00 s to 2.50 s: i2c1 0x68: not acknowledged"
    assert first == said
    assert second == "deadline imu.sample -> thrust: 3 missed"
    assert third.startswith(REFUSED)


def test_they_are_twelve_at_most_and_what_has_no_room_is_counted() -> None:
    wrong = [f"fault {number}" for number in range(20)]
    lines = closing_lines(["did"], wrong, ["off", "on time"])
    assert len(lines) == MOST
    assert lines[:2] == ["did", "fault 0"]
    assert lines[-3:] == ["and 12 more things went wrong", "off", "on time"]
    assert len(lines) - 4 + 12 == len(wrong)
    assert closing_lines(["did"], wrong[:9], ["off", "on time"]) == [
        *("did", *wrong[:9], "off", "on time")
    ]


def test_of_what_an_activation_spent_its_time_on_the_four_longest_are_said() -> None:
    causes = Causes(3.0, 0.0, 1.0, {"i2c1": {"0x40": 5.0}}, {"imu": 7.0, "yaw": 2.0})
    assert causes_text(causes) == (
        "imu 7.0 us, on the wire i2c1 0x40 5.0 us, waking 3.0 us, yaw 2.0 us"
    )
    assert causes_text(Causes(0.0, 0.0, 0.0, {}, {})) == "nothing measurable"


def test_a_robot_without_words_of_its_own_is_said_to_have_run() -> None:
    ran = run_of(0.0)
    assert did_text("heron", ran, None, {}) == "heron ran for 0.00 s"
    assert did_text("heron", ran, "it landed", {"height_m": 0.123456, "wet": False}) == (
        "heron ran for 0.00 s: it landed; height_m 0.1235, wet False"
    )
    assert stopped_text(ran, "SIGINT") == "stopped after 0.00 s: SIGINT"


@pytest.mark.parametrize(
    ("run", "statistics", "said"),
    [
        ("heron", "heron", ["view heron", "stats heron", "report heron", "replay heron"]),
        ("heron", None, ["view heron", "replay heron"]),
        (None, "x.stats", ["stats x.stats", "report x.stats"]),
    ],
)
def test_what_to_do_next_is_what_can_be_done(
    run: str | None, statistics: str | None, said: list[str]
) -> None:
    (line,) = next_text(run, statistics)
    begun, *others = line.removeprefix("next: firmware-runtime ").split(", ")
    assert [" ".join(each.split()[:2]) for each in (begun, *others)] == said


def test_after_a_run_that_left_nothing_nothing_is_next() -> None:
    assert list(next_text(None, None)) == []


def test_figures_are_read_from_json_as_they_were_written() -> None:
    found = run_of(*LATE)
    assert figures_from(found.as_json()) == found
