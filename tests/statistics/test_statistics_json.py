"""The JSON is a contract: keys in this spelling."""

import json

import pytest

from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import BUS, MODEL, WORST, Layout

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
