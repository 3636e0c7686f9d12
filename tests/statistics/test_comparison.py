"""Adding and subtracting statistics, cell by cell exact."""

from collections.abc import Mapping
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.comparison import (
    difference,
    differing_conditions,
    merged,
    same_run,
)
from firmware_runtime.statistics.file import StatisticsFile, save
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import LARGEST, SUM_CELL, Histogram
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import ELAPSED, MODEL, STATE, STEP_HISTOGRAM, Layout
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

LAYOUT = Layout(models=("imu",), timed=("imu",), buses=("i2c1",), deadlines=("yaw",), worst=2)
STATED = {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}}
SAMPLES = st.lists(st.integers(0, 2 * LARGEST), max_size=30)


class Counted:
    """A run that counts lateness and nothing else."""

    def __init__(self, board: str = "tachobot", stated: Mapping[str, Any] | None = None) -> None:
        header = {"models": stated or STATED, "conditions": {"board": board, "kernel": "6.1"}}
        self.file = StatisticsFile(LAYOUT, header)
        self.lateness = Histogram(self.file.cells[LAYOUT.lateness(0)])
        self.worst = WorstList(self.file.cells, LAYOUT)

    def count(self, samples: list[int]) -> Statistics:
        first = LAYOUT.model(0)
        for sample in samples:
            self.lateness.record(sample)
            for name in ("scheduled", "run"):
                self.file.cells[first + MODEL.index(name)] += 1
            self.file.cells[ELAPSED] += 10_000_000
            if sample > self.worst.smallest:
                row = [self.file.cells[ELAPSED], 0, sample, *[0] * (LAYOUT.place_cells - 3)]
                self.worst.keep(row)
        return self.file.statistics()


def buckets(statistics: Statistics) -> list[int]:
    return Histogram(statistics.cells[LAYOUT.lateness(0)]).buckets.tolist()


@pytest.mark.slow
@given(SAMPLES, SAMPLES)
def test_a_merge_is_the_histogram_of_all_samples(first: list[int], second: list[int]) -> None:
    both = merged([Counted().count(first), Counted().count(second)])
    together = Counted().count(first + second)
    assert both.cells[LAYOUT.lateness(0)] == together.cells[LAYOUT.lateness(0)]
    assert both.as_json()["lateness_us"] == together.as_json()["lateness_us"]
    assert both.as_json()["run"] == len(first) + len(second)


@pytest.mark.slow
@given(SAMPLES, SAMPLES, SAMPLES)
def test_merging_is_associative_and_commutative(
    first: list[int], second: list[int], third: list[int]
) -> None:
    a, b, c = (Counted().count(samples) for samples in (first, second, third))
    cells = [merged(order).cells[LAYOUT.lateness(0)].tolist() for order in ([a, b, c], [c, a, b])]
    nested = merged([merged([a, b]), c]).cells[LAYOUT.lateness(0)].tolist()
    assert cells[0] == cells[1] == nested


@pytest.mark.slow
@given(SAMPLES, SAMPLES)
def test_a_difference_is_what_was_counted_since(before: list[int], since: list[int]) -> None:
    run = Counted()
    earlier = run.count(before)
    later = run.count(since)
    found = difference(later, earlier)
    assert buckets(found) == buckets(Counted().count(since))
    assert found.cells[LAYOUT.lateness(0)][SUM_CELL] == sum(since)
    assert found.as_json()["run"] == len(since)
    assert found.cells[ELAPSED] == 10_000_000 * len(since)


@given(SAMPLES, SAMPLES)
def test_the_largest_since_is_never_too_low_nor_more_than_the_largest_of_all(
    before: list[int], since: list[int]
) -> None:
    run = Counted()
    earlier = run.count(before)
    largest = Histogram(difference(run.count(since), earlier).cells[LAYOUT.lateness(0)]).largest
    assert min(max(since, default=0), LARGEST) <= largest <= max(before + since, default=0)
    assert (largest == 0) == (max(since, default=0) == 0)


def test_only_the_worst_that_came_since_are_in_a_difference() -> None:
    run = Counted()
    earlier = run.count([5_000_000])
    found = difference(run.count([2_000_000]), earlier)
    assert [each["lateness_us"] for each in found.as_json()["worst"]] == [2000]


def test_a_merge_keeps_the_worst_of_all() -> None:
    found = merged([Counted().count([1_000, 9_000]), Counted().count([5_000, 7_000])])
    assert [each["lateness_us"] for each in found.as_json()["worst"]] == [9, 7]


def test_conditions_that_differ_are_named() -> None:
    runs = [Counted("tachobot").count([]), Counted("detective").count([])]
    assert differing_conditions(runs) == {"board": ["tachobot", "detective"]}
    conditions = merged(runs).as_json()["conditions"]
    assert (conditions["board"], conditions["kernel"]) == ("differs", "6.1")


def test_two_runs_have_no_difference() -> None:
    run = Counted()
    later = run.count([1, 2])
    assert not same_run(Counted().count([1]), later)
    with pytest.raises(StatisticsFileError, match="two runs"):
        difference(Counted().count([1]), later)


def test_runs_of_other_models_are_not_merged() -> None:
    other = StatisticsFile(Layout(), {"models": {}, "conditions": {}}).statistics()
    with pytest.raises(StatisticsFileError, match="expected runs of one board"):
        merged([Counted().count([]), other])


def test_runs_that_call_another_lateness_an_overrun_are_not_merged() -> None:
    stricter = {"imu": {**STATED["imu"], "tolerance_ns": 1_000}}
    with pytest.raises(StatisticsFileError, match="expected runs with the same settings"):
        merged([Counted().count([2_000]), Counted(stated=stricter).count([2_000])])


def test_a_merge_ended_as_the_worst_of_its_runs_in_whatever_order() -> None:
    ended, failed, died = (Counted() for _ in range(3))
    ended.file.cells[STATE] = RunState.ENDED
    failed.file.cells[STATE] = RunState.FAILED
    killed = replace(died.count([1]), writer_alive=False, complete=False)
    for runs in permutations([ended.count([1]), failed.count([1])]):
        assert merged(runs).state is RunState.FAILED
    for runs in permutations([ended.count([1]), failed.count([1]), killed]):
        found = merged(runs).as_json()["conditions"]["run"]
        assert (found["state"], found["complete"]) == ("died", False)


def test_when_the_sum_of_several_runs_was_last_late_is_not_stated() -> None:
    run = Counted()
    run.file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 1
    late = run.count([2_000_000])
    assert late.as_json()["models"]["imu"]["last_late_t_ns"] == 0
    assert merged([late, late]).as_json()["models"]["imu"]["last_late_t_ns"] is None


def test_a_saved_reading_is_read_back_as_it_was(tmp_path: Path) -> None:
    reading = Counted().count([60, 70])
    save(reading, tmp_path / "kept.stats")
    kept = read_statistics(tmp_path / "kept.stats")
    assert kept.as_json() == reading.as_json()
    assert kept.as_json()["conditions"]["run"]["state"] == "running"
    assert same_run(kept, reading)


def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(StatisticsFileError, match="cannot be kept there"):
        save(Counted().count([]), tmp_path / "missing" / "kept.stats")


def test_step_times_are_merged_too() -> None:
    runs = [Counted(), Counted()]
    for run in runs:
        Histogram(run.file.cells[STEP_HISTOGRAM]).record(500)
    found = merged([run.count([]) for run in runs])
    assert Histogram(found.cells[STEP_HISTOGRAM]).samples == 2
