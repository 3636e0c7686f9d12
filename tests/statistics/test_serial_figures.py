"""The serial ports of a run in its statistics: their cells, their figures, where they are shown."""

from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.hal.accounted_port import AccountedPort
from firmware_runtime.hal.budget import NO_TIME
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.links.ros2.judgement import wrong_counts
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.difference_text import difference_of
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import SERIAL, Layout
from firmware_runtime.statistics.metrics import exposition
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.report.verdict import verdict
from tests.support.executives import Run
from tests.support.phased_models import Phased

LAYOUT = Layout(deadlines=("yaw",), ports=("treads", "sonar"))
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
def file() -> StatisticsFile:
    return StatisticsFile(LAYOUT, HEADER)


def count_in(file: StatisticsFile) -> Statistics:
    file.open_section()
    for index, number in enumerate(COUNTED):
        file.cells[LAYOUT.port(0) + index] = number
    file.close_section(SECOND)
    return file.statistics()


def test_what_was_counted_is_read(file: StatisticsFile) -> None:
    assert len(COUNTED) == len(SERIAL)
    shown = count_in(file).as_json()["serial"]
    assert shown["treads"] == {
        "writes": 4,
        "bytes_written": 48,
        "bytes_read": 7,
        "errors": 2,
        "writing": 0.05,
        "reading": 0.007,
    }
    assert set(shown["sonar"].values()) == {0}


def test_readings_of_one_run_are_subtracted_and_runs_are_added(file: StatisticsFile) -> None:
    before = file.statistics()
    after = count_in(file)
    since = difference(after, before).as_json()["serial"]["treads"]
    twice = merged([after, after]).as_json()["serial"]["treads"]
    assert (since["bytes_written"], twice["bytes_written"], twice["errors"]) == (48, 96, 4)
    compared = difference_of(after, merged([after, after])).figures["serial.treads.bytes_read"]
    assert (compared.a, compared.b) == (7, 14)


def test_text_verdict_metrics_and_diagnostics_have_it(file: StatisticsFile) -> None:
    statistics = count_in(file)
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
