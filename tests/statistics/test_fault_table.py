"""Faults in the statistics file: bounded, cut to fit, added up and subtracted."""

import tracemalloc

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.fault_table import (
    KIND_CELLS,
    KINDS,
    MODEL_CELLS,
    OTHER_KINDS,
    SENTENCE_CELLS,
    FaultCount,
)
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import empty_cells
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.statistics import Statistics

LAYOUT = Layout(fault_models=("imu", "esc"))


def kept(*counted: FaultCount) -> list[FaultCount]:
    cells = empty_cells(2 * MODEL_CELLS)
    fault_table.fill(cells, 1, counted)
    assert fault_table.read(cells, 0) == []
    return fault_table.read(cells, 1)


def reading(**imu: tuple[int, int, int]) -> Statistics:
    """Statistics in which `imu` reported these kinds: count, first and last second."""
    file = StatisticsFile(LAYOUT, {"models": {}, "conditions": {"settings": {}}})
    counted = [
        FaultCount(kind, count, first * SECOND, last * SECOND, f"{kind} at {last}")
        for kind, (count, first, last) in imu.items()
    ]
    fault_table.fill(file.cells[LAYOUT.faults], 0, counted)
    return file.statistics()


def test_what_is_written_is_read() -> None:
    counted = [FaultCount("NotReady", 7, 740, 3740, "the robot moved"), FaultCount("BusFault", 1)]
    assert kept(*counted) == counted


def test_texts_are_cut_to_fit_and_can_always_be_printed() -> None:
    (found,) = kept(FaultCount("K" * 100, 1, 0, 0, "é" * 300 + "\n\ud800"))
    assert found.kind == "K" * (8 * KIND_CELLS)
    assert found.sentence == "é" * (4 * SENTENCE_CELLS)
    (found,) = kept(FaultCount("two\nlines", 1, 0, 0, "a\x1b[2Jb\ud800"))
    assert (found.kind + found.sentence).isprintable()


def test_kinds_beyond_the_last_are_counted_together() -> None:
    kinds = [FaultCount(f"Kind{n}", n + 1, n, 10 * n, f"sentence {n}") for n in range(KINDS + 3)]
    found = kept(*kinds)
    assert [each.kind for each in found] == [*(each.kind for each in kinds[:KINDS]), OTHER_KINDS]
    others = kinds[KINDS:]
    assert found[-1] == FaultCount(
        OTHER_KINDS,
        sum(each.count for each in others),
        others[0].first_at,
        others[-1].last_at,
        others[-1].sentence,
    )


def test_what_came_since_a_reading() -> None:
    later = reading(NotReady=(7, 1, 9), Warning=(1, 0, 0), BusFault=(2, 6, 8))
    found = difference(later, reading(NotReady=(3, 1, 4), Warning=(1, 0, 0))).as_json()["faults"]
    assert found == {
        "imu": {
            "NotReady": {"count": 4, "first_s": None, "last_s": 9.0, "last": "NotReady at 9"},
            "BusFault": {"count": 2, "first_s": 6.0, "last_s": 8.0, "last": "BusFault at 8"},
        }
    }


def test_the_sum_of_runs_has_no_instants() -> None:
    runs = [reading(NotReady=(7, 1, 9)), reading(BusFault=(2, 6, 8), NotReady=(1, 3, 3))]
    found = merged(runs).as_json()["faults"]["imu"]
    assert {kind: each["count"] for kind, each in found.items()} == {"NotReady": 8, "BusFault": 2}
    assert {each["first_s"] for each in found.values()} == {None}
    assert {each["last_s"] for each in found.values()} == {None}


def test_of_a_huge_sentence_only_what_is_kept_is_read() -> None:
    cells, counted = (
        empty_cells(fault_table.ROW_CELLS),
        FaultCount("NotReady", 1, 0, 0, "long " * 1_000_000),
    )
    tracemalloc.start()
    fault_table.write(cells, counted)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 100_000
