"""Histograms, the places of the cells, and the typed figures that are read from them."""

import gzip
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import convert

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.difference_text import difference_of
from firmware_runtime.statistics.fault_table import MODEL_CELLS
from firmware_runtime.statistics.figures import Activations, BusFigures, Figures, figures_of
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import (
    BUCKETS,
    CELLS,
    LARGEST,
    LARGEST_SUM,
    Distribution,
    Histogram,
    bucket_of,
    empty_cells,
    upper_edge,
)
from firmware_runtime.statistics.histogram_text import histogram_text
from firmware_runtime.statistics.layout import (
    BUS,
    DEADLINE,
    MODEL,
    REASON,
    RUN,
    SERIAL,
    TIMELINE,
    Layout,
)
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.rows import BusRow, ModelRow, WorstRow, as_counted, counters
from firmware_runtime.statistics.statistics import Statistics

SAMPLES = st.lists(st.integers(0, 2 * LARGEST), max_size=60)


def histogram(*samples: int) -> Histogram:
    made = Histogram(empty_cells())
    for sample in samples:
        made.record(sample)
    return made


def exact_percentile(samples: list[int], thousandths: int) -> int:
    rank = max(-(-len(samples) * thousandths // 1000), 1)
    return sorted(samples)[rank - 1]


def test_buckets_follow_each_other_without_gap_or_overlap() -> None:
    first = 0
    for bucket in range(BUCKETS):
        last = upper_edge(bucket)
        assert bucket_of(first) == bucket_of(last) == bucket
        first = last + 1
    assert first == LARGEST + 1


def test_the_range_is_from_one_nanosecond_to_over_a_hundred_seconds() -> None:
    assert upper_edge(1) == 1
    assert LARGEST > 100 * 10**9


@given(SAMPLES.filter(bool), st.sampled_from([500, 900, 990, 999]))
def test_a_percentile_is_never_too_low_and_at_most_a_thirty_second_too_high(
    samples: list[int], thousandths: int
) -> None:
    samples = [min(sample, LARGEST) for sample in samples]
    exact = exact_percentile(samples, thousandths)
    reported = histogram(*samples).percentile(thousandths)
    assert reported is not None
    assert exact <= reported <= min(exact * 33 // 32 + 1, max(samples))


@given(SAMPLES)
def test_the_maximum_is_exact_even_beyond_the_last_bucket(samples: list[int]) -> None:
    assert histogram(*samples).largest == max(samples, default=0)


@given(SAMPLES, SAMPLES)
def test_merging_equals_recording_both(first: list[int], second: list[int]) -> None:
    merged, both = histogram(*first), histogram(*first, *second)
    merged.merge(histogram(*second))
    assert merged.buckets == both.buckets
    assert merged.largest == both.largest


@given(SAMPLES)
def test_one_that_is_restored_is_as_it_was_and_counts_on(samples: list[int]) -> None:
    kept, restored = histogram(*samples), histogram(7)
    restored.restore(kept.state())
    for each in (kept, restored):
        each.record(9)
    assert (restored.cells, restored.largest) == (kept.cells, kept.largest)


@pytest.mark.parametrize("count", [-1, (1 << 62) + 1])
def test_counts_of_no_histogram_are_not_restored(count: int) -> None:
    with pytest.raises(ValueError, match="counts of no histogram"):
        histogram().restore({8: count.to_bytes(8, sys.byteorder, signed=True)})


def test_a_single_sample_is_every_percentile() -> None:
    assert histogram(1234567).summary_us() == Distribution(*[1234.567] * 6)


def test_a_rank_is_rounded_up_and_never_beyond_the_last_sample() -> None:
    found = histogram(*[10] * 999, 20, 20)
    assert found.percentile(998) == 10
    assert found.percentile(999) == 20
    assert histogram(10, 20).percentile(500) == 10
    assert histogram(10, 20).percentile(1) == 10


def test_an_empty_one_has_no_percentiles_rather_than_zeros() -> None:
    assert histogram().summary_us() == Distribution()


def test_a_sum_that_finds_no_room_stops_there_and_gives_no_mean() -> None:
    most = LARGEST_SUM // 2
    found, other = histogram(most, most - 1), histogram(most, most)
    assert found.summary_us().mean == (most - 0.5) / 1000
    for each in (found, other):
        each.record(LARGEST_SUM)
        found.merge(other)
        assert (found.sum, found.largest) == (LARGEST_SUM, LARGEST_SUM)
        assert found.summary_us().p50 is not None
        assert found.summary_us().mean is None


def test_zero_is_a_sample() -> None:
    assert histogram(0).samples == 1
    assert histogram(0).percentile(500) == 0


@pytest.mark.parametrize("negative", [-1, -(10**9)])
def test_a_negative_sample_counts_as_zero(negative: int) -> None:
    assert histogram(negative).buckets[0] == 1


def test_one_late_sample_in_a_thousand_shows_in_the_maximum_and_not_in_the_percentiles() -> None:
    summary = histogram(*[1000] * 999, 5_000_000).summary_us()
    assert summary.p999 is not None
    assert summary.p999 < 1.1
    assert summary.max == 5000


NAMES = st.lists(st.sampled_from(["imu", "compass", "controller.yaw"]), max_size=4).map(tuple)
LAYOUTS = st.builds(Layout, NAMES, NAMES, NAMES, NAMES, st.integers(1, 20), NAMES, ports=NAMES)


@given(LAYOUTS)
def test_blocks_follow_each_other_and_fill_the_file(layout: Layout) -> None:
    at = len(RUN) + CELLS
    for index in range(len(layout.models)):
        assert layout.model(index) == at
        assert layout.lateness(index) == slice(at + len(MODEL), at + len(MODEL) + CELLS)
        assert layout.step(index).start == layout.lateness(index).stop
        at = layout.step(index).stop
    for index in range(len(layout.buses)):
        assert layout.bus(index) == at
        at += len(BUS)
    for index in range(len(layout.deadlines)):
        assert layout.deadline(index) == at
        at += len(DEADLINE)
    for index in range(len(layout.ports)):
        assert layout.port(index) == at
        at += len(SERIAL)
    assert layout.place(0) == at
    assert layout.reason.start == at + layout.worst * layout.place_cells
    assert layout.timeline.start == layout.reason.stop == layout.reason.start + REASON
    assert layout.faults.start == layout.timeline.stop == layout.timeline.start + TIMELINE
    assert layout.cells == layout.faults.stop
    assert layout.cells - layout.faults.start == len(layout.fault_models) * MODEL_CELLS


def test_what_only_grows_is_said_where_a_field_is_defined() -> None:
    assert counters(ModelRow) == [*Activations.__struct_fields__, "irregular", "reactions"]
    assert counters(BusRow) == list(BUS)
    assert counters(WorstRow) == []


def test_a_field_with_the_name_of_a_figure_is_that_figure() -> None:
    row = BusRow(transactions=1, bytes=2, errors=3, retries=4, busy_ns=5)
    shown = {"transactions": 1, "bytes": 2, "errors": 3, "retries": 4}
    assert as_counted(row, BusFigures) == shown


@given(LAYOUTS)
def test_it_survives_the_header(layout: Layout) -> None:
    description = json.loads(json.dumps(layout.describe()))
    assert convert(description, Layout) == layout


def test_its_description_places_every_block_for_programs_that_do_not_know_it() -> None:
    layout = Layout(
        models=("imu", "compass"), buses=("i2c1",), deadlines=("yaw",), ports=("a", "b")
    )
    description = layout.describe()
    block = description["model_block"]
    assert block["at"] + block["stride"] * 1 == layout.model(1)
    assert description["bus_block"]["at"] == layout.bus(0)
    assert description["deadline_block"]["at"] == layout.deadline(0)
    block = description["port_block"]
    assert block["at"] + block["stride"] == layout.port(1)
    assert description["worst_block"]["at"] == layout.place(0)
    assert description["timeline_block"]["at"] == layout.timeline.start
    assert description["fault_block"]["at"] == layout.faults.start
    assert description["cells"] == layout.cells


def test_a_file_from_before_faults_were_counted_has_none() -> None:
    description = Layout(models=("imu",)).describe()
    del description["fault_models"]
    assert convert(description, Layout) == Layout(models=("imu",))


GOLDEN = Path(__file__).parent / "golden"
"""Files that runs have written, and what `stats --json` printed of them in schema 1."""
RUNS = ("uneven", "troubled", "real", "virtual")


def kept(name: str, folder: Path) -> Statistics:
    path = folder / f"{name}.stats"
    path.write_bytes(gzip.decompress((GOLDEN / f"{name}.stats.gz").read_bytes()))
    return read_statistics(path)


def printed(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((GOLDEN / f"{name}.json").read_text())
    found.pop("takeovers", None)  # a guard's, beside the statistics
    return found


@pytest.mark.parametrize("name", RUNS)
def test_the_json_of_a_file_is_what_it_always_was(name: str, tmp_path: Path) -> None:
    assert kept(name, tmp_path).as_json() == printed(name)


def test_cyclictest_s_layout_has_a_column_for_each_model_also_for_one_without_a_sample() -> None:
    layout = Layout(models=("imu", "compass", "sonar"))
    stated = {"period_ns": 1, "tolerance_ns": 1, "policy": "skip"}
    header = {"models": dict.fromkeys(layout.models, stated), "conditions": {}}
    file = StatisticsFile(layout, header)
    for number, lateness in ((0, 3_500), (0, 3_900), (2, 1)):
        Histogram(file.cells[layout.lateness(number)]).record(lateness)
    assert [*histogram_text(file.statistics())] == [
        "# imu compass sonar",
        "# Histogram",
        "000000 000000 000000 000001",
        "000001 000000 000000 000000",
        "000002 000000 000000 000000",
        "000003 000002 000000 000000",
        "# Total: 000000002 000000000 000000001",
        "# Min Latencies: 00003 00000 00000",
        "# Avg Latencies: 00003 00000 00000",
        "# Max Latencies: 00003 00000 00000",
        "# Histogram Overflows: 00000 00000 00000",
        "# Histogram Overflow at cycle number:",
        "# Thread 0:",
        "# Thread 1:",
        "# Thread 2:",
    ]


def test_a_difference_is_what_it_always_was(tmp_path: Path) -> None:
    first, second = (kept(name, tmp_path) for name in ("uneven", "troubled"))
    assert difference_of(first, second).as_json() == printed("uneven-troubled")


@pytest.mark.parametrize("name", RUNS)
def test_figures_come_back_from_their_json(name: str, tmp_path: Path) -> None:
    assert figures_of(json.dumps(printed(name)), "here") == kept(name, tmp_path).figures()


def test_figures_have_types(tmp_path: Path) -> None:
    figures = kept("real", tmp_path).figures()
    imu = figures.models["imu"]
    assert (imu.kind, imu.period_us, figures.rate_hz) == ("periodic", 10_000, 100)
    assert figures.conditions.run.state == "ended"
    assert figures.conditions.settings["fifo_priority"].asked == 60
    assert figures.lateness_us.max == max(
        model.lateness_us.max or 0 for model in figures.models.values()
    )
    assert isinstance(figures, Figures)


@pytest.mark.parametrize(
    ("damage", "where"),
    [
        ({"schema": 2}, "schema: invalid value 2"),
        ({"run": "many"}, "run: expected `int`, got `str`"),
        ({"models": {"imu": {}}}, "models[...]: object missing"),
        ({"conditions": None}, "conditions: expected `object`, got `null`"),
    ],
)
def test_json_of_another_shape_is_refused_with_its_place(
    damage: dict[str, Any], where: str
) -> None:
    with pytest.raises(StatisticsFileError) as refusal:
        figures_of(json.dumps({**printed("real"), **damage}), "robot.local")
    assert str(refusal.value).startswith("robot.local: ")
    assert where in str(refusal.value)


@pytest.mark.parametrize("text", ["", "no JSON", "[]", "[" * 100_000])
def test_what_is_no_json_is_refused(text: str) -> None:
    with pytest.raises(StatisticsFileError):
        figures_of(text, "robot.local")
