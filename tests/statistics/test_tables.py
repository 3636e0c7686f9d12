"""Faults and serial ports in the statistics, and the page that names every key."""

import math
import re
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.budget import NO_TIME
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.links.ros2.judgement import wrong_counts
from firmware_runtime.models.dover import SndDover
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.difference_text import difference_of
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
from firmware_runtime.statistics.layout import SERIAL, WORST, Layout
from firmware_runtime.statistics.metrics import exposition
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.takeovers import Takeover
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.view.report.verdict import verdict
from tests.support.atomic_bench import AtomicBench
from tests.support.executives import Run
from tests.support.phased_models import Phased

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


def test_one_kind_beyond_the_last_counts_too() -> None:
    kinds = [FaultCount(f"Kind{n}", 1, n, n, "") for n in range(KINDS + 1)]
    assert [(each.count, each.first_at) for each in kept(*kinds)] == [
        (1, n) for n in range(KINDS + 1)
    ]


def test_what_came_since_a_reading() -> None:
    later = reading(NotReady=(7, 1, 9), Warning=(1, 0, 0), BusFault=(2, 6, 8))
    found = difference(later, reading(NotReady=(3, 1, 4), Warning=(1, 0, 0))).as_json()["faults"]
    assert found == {
        "imu": {
            "NotReady": {"count": 4, "first_s": None, "last_s": 9.0, "last": "NotReady at 9"},
            "BusFault": {"count": 2, "first_s": 6.0, "last_s": 8.0, "last": "BusFault at 8"},
        }
    }


def test_a_fault_that_came_once_since_a_reading_is_in_the_difference() -> None:
    later = reading(NotReady=(4, 1, 9), BusFault=(1, 6, 6))
    found = difference(later, reading(NotReady=(3, 1, 4))).faults()["imu"]
    assert {kind: each.count for kind, each in found.items()} == {"NotReady": 1, "BusFault": 1}


def test_the_sum_of_runs_has_no_instants() -> None:
    runs = [reading(NotReady=(7, 1, 9)), reading(BusFault=(2, 6, 8), NotReady=(1, 3, 3))]
    found = merged(runs).as_json()["faults"]["imu"]
    assert {kind: each["count"] for kind, each in found.items()} == {"NotReady": 8, "BusFault": 2}
    assert {each["first_s"] for each in found.values()} == {None}
    assert {each["last_s"] for each in found.values()} == {None}


def test_faults_that_are_restored_are_in_the_file_at_once_and_no_later_ones() -> None:
    bench = AtomicBench(block := SndDover("snd", 62002))
    log = FaultLog(bench.simulator)
    layout = Layout(fault_models=log.models)
    cells = StatisticsFile(layout, {"models": {}, "conditions": {}}).cells
    log.count_in(cells, layout)
    kept = []
    for number in (math.inf, 1e300):
        kept.append(log.state())
        bench.simulator.inject(block.value, number)
        bench.simulator.advance(bench.simulator.now)
        bench.run(1)
    assert [each.kind for each in log.counted] == ["NotFinite", "TooLong"]
    log.restore(kept[1])
    found = fault_table.read(cells[layout.faults], 0)
    assert [(each.kind, each.count) for each in found] == [("NotFinite", 1)]


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


PORTS = Layout(deadlines=("yaw",), ports=("treads", "sonar"))
HEADER: dict[str, Any] = {"models": {}, "conditions": {}}
COUNTED = (4, 48, 7, 2, 50_000_000, 7_000_000)


class Echo(SerialPort):
    """What is written comes back."""

    name = "treads"

    def __init__(self) -> None:
        self.waiting = b""

    def write(self, data: bytes) -> None:
        self.waiting += data

    def read_available(self) -> bytes:
        taken, self.waiting = self.waiting, b""
        return taken

    def close(self) -> None:
        pass


@pytest.fixture
def port_file() -> StatisticsFile:
    return StatisticsFile(PORTS, HEADER)


def count_in(port_file: StatisticsFile) -> Statistics:
    port_file.open_section()
    for index, number in enumerate(COUNTED):
        port_file.cells[PORTS.port(0) + index] = number
    port_file.close_section(SECOND)
    return port_file.statistics()


def test_what_was_counted_is_read(port_file: StatisticsFile) -> None:
    assert len(COUNTED) == len(SERIAL)
    shown = count_in(port_file).as_json()["serial"]
    assert shown["treads"] == {
        "writes": 4,
        "bytes_written": 48,
        "bytes_read": 7,
        "errors": 2,
        "writing": 0.05,
        "reading": 0.007,
    }
    assert set(shown["sonar"].values()) == {0}


def test_readings_of_one_run_are_subtracted_and_runs_are_added(port_file: StatisticsFile) -> None:
    before = port_file.statistics()
    after = count_in(port_file)
    since = difference(after, before).as_json()["serial"]["treads"]
    twice = merged([after, after]).as_json()["serial"]["treads"]
    assert (since["bytes_written"], twice["bytes_written"], twice["errors"]) == (48, 96, 4)
    compared = difference_of(after, merged([after, after])).figures["serial.treads.bytes_read"]
    assert (compared.a, compared.b) == (7, 14)


def test_text_verdict_metrics_and_diagnostics_have_it(port_file: StatisticsFile) -> None:
    statistics = count_in(port_file)
    figures = statistics.figures()
    (line,) = [each for each in statistics_text(figures) if "port treads" in each]
    assert "4 writes, 48 bytes written, 7 bytes read, 2 errors" in line
    assert "2 calls of a serial port failed." in verdict(figures).sentences
    text = exposition("rover", statistics)
    assert 'serial_bytes_written_total{board="rover",port="treads"} 48.0' in text
    assert 'serial_seconds_total{board="rover",direction="reading",port="treads"} 0.007' in text
    assert wrong_counts(figures)["serial treads"] == 2


def test_a_robot_without_one_has_no_such_figure() -> None:
    statistics = StatisticsFile(Layout(), HEADER).statistics()
    assert "serial" not in statistics.as_json()
    assert "serial" not in exposition("rover", statistics)


def test_a_run_counts_its_ports_step_by_step() -> None:
    port = AccountedPort(Echo(), 9600, NO_TIME)
    port.write(b"before")
    model = Phased("talker", SECOND, [SECOND])
    run = Run(model, VirtualClock(), Configuration(ports=[port]))
    seen = []

    def talk(_number: int) -> None:
        seen.append(run.json()["serial"]["treads"]["bytes_written"])
        port.write(b"hello")

    model.work = talk
    run.until(2 * SECOND)
    assert seen == [6, 11, 16]
    assert run.json()["serial"]["treads"]["bytes_written"] == 21


PAGE = Path(__file__).parents[2] / "docs" / "statistics.md"
NAMES = {"imu", "thrust", "i2c1", "yaw"}
"""Of the run's own: keys that no page can know."""


def keys_in(value: object) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from keys_in(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from keys_in(inner)


def test_every_key_is_named_there(counted: StatisticsFile) -> None:
    layout = counted.layout
    counted.cells[layout.place(0) + WORST.index("step_ns")] = 1
    printed = set(keys_in(counted.statistics().as_json())) - NAMES
    printed |= system_conditions().keys() | set(Takeover.__struct_encode_fields__)
    named = {
        word
        for code in re.findall(r"`([^`\n]+)`", PAGE.read_text())
        for word in re.findall(r"\w+", code)
    }
    assert "causes" in printed
    assert sorted(printed - named) == []
