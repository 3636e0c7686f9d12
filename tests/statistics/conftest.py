"""A small run's statistics: one periodic model, one bus, one deadline."""

from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import STEP_HISTOGRAM, Layout

LAYOUT = Layout(
    models=("imu",), timed=("imu", "thrust"), buses=("i2c1",), deadlines=("yaw",), worst=2
)
HEADER: dict[str, Any] = {
    "models": {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}},
    "conditions": {"board": "tachobot"},
}


@pytest.fixture
def layout() -> Layout:
    return LAYOUT


@pytest.fixture
def header() -> dict[str, Any]:
    return HEADER


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture
def file(path: Path) -> StatisticsFile:
    return StatisticsFile(LAYOUT, HEADER, path)


@pytest.fixture
def counted(file: StatisticsFile) -> StatisticsFile:
    """A file in which 90 of 100 activations ran, two of them late, and ten were skipped."""
    cells = file.cells
    file.open_section()
    first = LAYOUT.model(0)
    cells[first : first + 7] = memoryview_of(100, 90, 10, 0, 2, 1, 450_000_000)
    lateness = Histogram(cells[LAYOUT.lateness(0)])
    for _ in range(88):
        lateness.record(60)
    lateness.record(2_000_000)
    lateness.record(105_000_000)
    Histogram(cells[LAYOUT.step(0)]).record(300_000)
    Histogram(cells[STEP_HISTOGRAM]).record(900_000)
    cells[LAYOUT.bus(0) : LAYOUT.bus(0) + 5] = memoryview_of(180, 5400, 3, 2, 121_500_000)
    cells[LAYOUT.deadline(0) : LAYOUT.deadline(1)] = memoryview_of(4, 90, 89)
    file.close_section(1_000_000_000)
    return file


def memoryview_of(*values: int) -> "memoryview[int]":
    made = memoryview(bytearray(8 * len(values))).cast("q")
    for index, value in enumerate(values):
        made[index] = value
    return made
