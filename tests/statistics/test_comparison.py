"""Adding and subtracting statistics; their JSON is a contract."""

import json
from collections.abc import Mapping
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.comparison import (
    difference,
    differing_conditions,
    merged,
    same_run,
)
from firmware_runtime.statistics.fault_table import FaultCount
from firmware_runtime.statistics.file import StatisticsFile, save
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import LARGEST, SUM_CELL, Histogram
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import (
    BUS,
    ELAPSED,
    MODEL,
    STATE,
    STEP_HISTOGRAM,
    WORST,
    YIELDED,
    Layout,
)
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

LAYOUT = Layout(models=("imu",), timed=("imu",), buses=("i2c1",), deadlines=("yaw",), worst=2)
STATED = {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}}
SETTINGS = {"fifo_priority": {"asked": 60, "granted": True, "reason": None}}
SAMPLES = st.lists(st.integers(0, 2 * LARGEST), max_size=30)


class Counted:
    """A run that counts lateness and nothing else."""

    def __init__(self, board: str = "tachobot", stated: Mapping[str, Any] | None = None) -> None:
        conditions = {"board": board, "kernel": "6.1", "settings": SETTINGS}
        header = {"models": stated or STATED, "conditions": conditions}
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
@settings(max_examples=50)
@given(SAMPLES, SAMPLES)
def test_a_merge_is_the_histogram_of_all_samples(first: list[int], second: list[int]) -> None:
    both = merged([Counted().count(first), Counted().count(second)])
    together = Counted().count(first + second)
    assert both.cells[LAYOUT.lateness(0)] == together.cells[LAYOUT.lateness(0)]
    assert both.as_json()["lateness_us"] == together.as_json()["lateness_us"]
    assert both.as_json()["run"] == len(first) + len(second)


@pytest.mark.slow
@settings(max_examples=50)
@given(SAMPLES, SAMPLES, SAMPLES)
def test_merging_is_associative_and_commutative(
    first: list[int], second: list[int], third: list[int]
) -> None:
    a, b, c = (Counted().count(samples) for samples in (first, second, third))
    cells = [merged(order).cells[LAYOUT.lateness(0)].tolist() for order in ([a, b, c], [c, a, b])]
    nested = merged([merged([a, b]), c]).cells[LAYOUT.lateness(0)].tolist()
    assert cells[0] == cells[1] == nested


@pytest.mark.slow
@settings(max_examples=50)
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


def test_what_buses_ports_and_deadlines_counted_since_is_in_a_difference() -> None:
    layout = Layout(buses=("i2c1",), deadlines=("yaw",), ports=("treads",))
    file = StatisticsFile(layout, {"models": {}, "conditions": {}})
    blocks = layout.bus(0), layout.deadline(0), layout.port(0)
    before = file.statistics()
    for cell in blocks:
        file.cells[cell] += 4
    earlier = file.statistics()
    for cell in blocks:
        file.cells[cell] += 3
    for first, expected in ((before, 7), (earlier, 3)):
        cells = difference(file.statistics(), first).cells
        assert [cells[cell] for cell in blocks] == [expected] * 3


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
    assert differing_conditions(runs[:1]) == {}
    conditions = merged(runs).header.conditions
    assert conditions == {"board": "differs", "kernel": "6.1", "settings": SETTINGS}


def test_one_run_alone_is_its_sum() -> None:
    run = Counted().count([1_000, 9_000])
    found = merged([run])
    assert (found.header, found.figures().lateness_us) == (run.header, run.figures().lateness_us)


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


def test_what_one_of_several_runs_lacked_or_gave_up_is_in_the_merge() -> None:
    sound, other = Counted().count([1_000]), Counted()
    other.file.cells[YIELDED] = 7_000_000_000
    bad = replace(other.count([1_000]), complete=False)
    for runs in permutations([sound, bad]):
        run = merged(runs).figures().conditions.run
        assert (run.overloaded_s, run.complete) == (7.0, False)


def test_a_fault_of_several_runs_has_its_words() -> None:
    layout = Layout(models=("imu",), fault_models=("imu",), worst=1)
    runs = []
    for words in ("first", "second"):
        file = StatisticsFile(layout, {"models": STATED, "conditions": {}})
        counted = FaultCount("Stuck", 2, 5, 9, words)
        fault_table.write(fault_table.row(file.cells[layout.faults], 0, 0), counted)
        runs.append(file.statistics())
    (found,) = merged(runs).faults()["imu"].values()
    assert (found.count, found.last_s, found.last) == (4, None, "second")


def test_runs_whose_sum_finds_no_room_are_not_merged() -> None:
    long = Counted()
    long.file.cells[ELAPSED] = 1 << 62
    run = long.count([1 << 61, (1 << 61) - 1])
    with pytest.raises(StatisticsFileError, match="more than statistics hold"):
        merged([run, run])
    assert run.figures().lateness_us.mean == ((1 << 62) - 1) / 2 / 1000


def test_what_a_full_sum_grew_by_is_not_known() -> None:
    counted = Counted()
    before = counted.count([1 << 61])
    since = difference(counted.count([1 << 62]), before)
    assert since.figures().lateness_us.p50 is not None
    assert since.figures().lateness_us.mean is None


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


NO_DISTRIBUTION = dict.fromkeys(["p50", "p90", "p99", "p999", "max", "mean"])


def test_it_has_the_keys_of_the_contract(counted: StatisticsFile) -> None:
    assert list(counted.statistics().as_json()) == [
        "schema",
        "scheduled",
        "run",
        "skipped",
        "coalesced",
        "overruns",
        "episodes",
        "deadline_misses",
        "deadlines",
        "lateness_us",
        "step_us",
        "models",
        "bus",
        "faults",
        "worst",
        "conditions",
    ]


def test_it_can_be_written_as_json(counted: StatisticsFile) -> None:
    statistics = counted.statistics().as_json()
    assert json.loads(json.dumps(statistics)) == statistics


def test_a_model_has_its_counters_its_policy_and_its_distributions(
    counted: StatisticsFile,
) -> None:
    model = counted.statistics().as_json()["models"]["imu"]
    assert model["lateness_us"].pop("p50") == 0.06
    assert model["lateness_us"]["max"] == 105_000
    del model["lateness_us"]
    assert model == {
        "scheduled": 100,
        "run": 90,
        "skipped": 10,
        "coalesced": 0,
        "overruns": 2,
        "episodes": 1,
        "last_late_t_ns": 450_000_000,
        "kind": "periodic",
        "period_us": 10_000,
        "waiting": 0,
        "reactions": 0,
        "irregular": 0,
        "returned_after_us": None,
        "tolerance_us": 1_000,
        "policy": "skip",
        "step_us": dict.fromkeys(NO_DISTRIBUTION, 300),
        "load": 0.0003,
    }


def test_a_bus_has_its_counters_and_its_share_of_the_time(counted: StatisticsFile) -> None:
    assert counted.statistics().as_json()["bus"] == {
        "i2c1": {
            "transactions": 180,
            "bytes": 5400,
            "errors": 3,
            "retries": 2,
            "utilisation": 0.1215,
        }
    }


def test_a_run_that_has_not_begun_has_nulls_where_nothing_was_measured(
    file: StatisticsFile,
) -> None:
    statistics = file.statistics().as_json()
    assert statistics["lateness_us"] == statistics["step_us"] == NO_DISTRIBUTION
    assert statistics["models"]["imu"]["last_late_t_ns"] is None
    assert statistics["bus"]["i2c1"]["utilisation"] is None
    assert statistics["scheduled"] == 0
    assert statistics["worst"] == []


def test_totals_are_the_sums_over_models_and_the_merged_distribution() -> None:
    layout = Layout(models=("imu", "compass"))
    stated = {"period_ns": 1, "tolerance_ns": 1, "policy": "skip"}
    header = {"models": {"imu": stated, "compass": stated}, "conditions": {}}
    file = StatisticsFile(layout, header)
    for index, run, late_bucket in ((0, 3, 5), (1, 4, 7)):
        file.cells[layout.model(index) + MODEL.index("run")] = run
        lateness = Histogram(file.cells[layout.lateness(index)])
        for _ in range(run):
            lateness.record(late_bucket)
    statistics = file.statistics().as_json()
    assert statistics["run"] == 7
    assert statistics["lateness_us"]["p50"] == 0.007
    assert statistics["lateness_us"]["max"] == 0.007
    assert statistics["lateness_us"]["mean"] == (3 * 5 + 4 * 7) / 7 / 1000


def test_the_worst_activations_come_first_with_their_causes(
    file: StatisticsFile, layout: Layout
) -> None:
    worst = WorstList(file.cells, layout)
    devices = [0x40, 0x68, 0, 0, 0, 0, 0, 0, 850_000, 0, 0, 0, 0, 0, 0, 0]
    worst.keep([10, 0, 1_000, 5_000, 400, 600, 0, 0, 4_000, *devices])
    worst.keep([20, 0, 9_000, 5_000, 9_000, 0, 70, 3_000, 0, *[0] * 16])
    latest, longest = file.statistics().as_json()["worst"]
    assert latest["t_ns"] == 20
    assert longest == {
        "t_ns": 10,
        "model": "imu",
        "lateness_us": 1.0,
        "step_us": 5.0,
        "causes": {
            "wake_us": 0.4,
            "behind_us": 0.6,
            "garbage_us": 0.0,
            "bus_us": {"i2c1": {"0x40": 850.0}},
            "models_us": {"thrust": 4.0},
        },
    }


def test_a_worse_activation_takes_the_place_of_the_least_bad(
    file: StatisticsFile, layout: Layout
) -> None:
    worst = WorstList(file.cells, layout)
    for lateness in (30, 10, 20):
        assert lateness > worst.smallest
        worst.keep([lateness, 0, lateness, 0, *[0] * (layout.place_cells - 4)])
    assert worst.smallest == 20
    assert [each["t_ns"] for each in file.statistics().as_json()["worst"]] == [30, 20]


@pytest.mark.parametrize("fields", [MODEL, BUS, WORST])
def test_names_of_fields_are_not_used_twice(fields: tuple[str, ...]) -> None:
    assert len(set(fields)) == len(fields)
