"""What a reader adds to the counts of a run that is late, or dead: what was due by then."""

from typing import Any

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.statistics import file_header
from firmware_runtime.statistics.fault_table import NO_INSTANT
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState, count_overdue, waiting
from firmware_runtime.statistics.layout import (
    ELAPSED,
    GUARD,
    HEARTBEAT,
    MODEL,
    STATE,
    WRITTEN,
    Layout,
)
from firmware_runtime.statistics.statistics import Statistics

PERIOD = 10 * MILLISECOND
BEGAN = 1000 * MILLISECOND
WRITTEN_AT = 5000 * MILLISECOND
LATER = 95 * MILLISECOND
LAYOUT = Layout(models=("first", "imu"))
PERIODIC = {"kind": "periodic", "period_ns": PERIOD, "tolerance_ns": 0}
FIRST = LAYOUT.model(1)
SCHEDULED, SKIPPED = FIRST + MODEL.index("scheduled"), FIRST + MODEL.index("skipped")


def run(
    policy: str = "skip",
    speed: float | None = 1.0,
    *,
    is_in_period: bool = False,
    due: int = BEGAN + PERIOD,
) -> StatisticsFile:
    """A run whose sensor is due a period after what was written last."""
    models = {name: {**PERIODIC, "policy": policy} for name in LAYOUT.models}
    file = StatisticsFile(
        LAYOUT, {"models": models, "conditions": {}, "clock_speed": speed, "until_ns": NEVER}
    )
    file.cells[HEARTBEAT], file.cells[ELAPSED] = WRITTEN_AT, BEGAN
    file.cells[LAYOUT.model(0) + MODEL.index("due_ns")] = NEVER
    file.cells[FIRST + MODEL.index("due_ns")] = due
    file.cells[FIRST + MODEL.index("is_in_period")] = is_in_period
    file.cells[SCHEDULED], file.cells[SKIPPED] = 100, 5
    return file


def seen(file: StatisticsFile, *, is_alive: bool) -> tuple[int, int, int, int]:
    """Ns that have passed since, deadlines and skips in them, and what waits."""
    cells = file.cells
    count_overdue(cells, file.header, is_alive=is_alive)
    assert cells[LAYOUT.model(0) + MODEL.index("scheduled")] == 0
    passed = cells[ELAPSED] - BEGAN
    waits = waiting(cells, file.header, 1)
    return passed, cells[SCHEDULED] - 100, cells[SKIPPED] - 5, waits


@pytest.fixture(autouse=True)
def _later(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_header, "monotonic_ns", lambda: WRITTEN_AT + LATER)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ({}, (LATER, 8, 8, 1)),
        ({"is_in_period": True}, (LATER, 9, 9, 0)),
        ({"due": BEGAN + LATER}, (LATER, 0, 0, 1)),
        ({"due": BEGAN + LATER + 1}, (LATER, 0, 0, 0)),
        ({"policy": "catch-up"}, (LATER, 0, 0, 9)),
        ({"speed": 2.0}, (2 * LATER, 17, 17, 2)),
        ({"speed": None}, (0, 0, 0, 0)),
    ],
    ids=["skips", "in its period", "due now", "not due", "catches up", "fast", "no speed"],
)
def test_of_a_run_that_lives_what_will_not_run_any_more_is_skipped(
    stated: dict[str, Any], expected: tuple[int, ...]
) -> None:
    assert seen(run(**stated), is_alive=True) == expected


@pytest.mark.parametrize("policy", ["skip", "catch-up"])
def test_of_a_dead_run_all_is_skipped_that_was_due_while_its_guard_saw_it(policy: str) -> None:
    file = run(policy)
    file.cells[GUARD] = WRITTEN_AT + 40 * MILLISECOND
    assert seen(file, is_alive=False)[:3] == (40 * MILLISECOND, 4, 4)
    assert file.cells[WRITTEN] == file.cells[GUARD]
    assert seen(run(policy), is_alive=False)[:3] == (0, 0, 0)


def test_of_a_run_that_is_over_or_has_not_begun_nothing_is_overdue() -> None:
    over, begins = run(), run()
    over.cells[STATE] = RunState.ENDED
    begins.cells[HEARTBEAT] = 0
    assert seen(over, is_alive=True) == (0, 0, 0, 0)
    assert seen(begins, is_alive=True)[:3] == (0, 0, 0)


@pytest.mark.parametrize(
    ("overruns", "last_late", "said"), [(0, 7, None), (1, 0, 0), (1, NO_INSTANT, None)]
)
def test_when_a_model_was_last_late_is_said_if_it_ever_was(
    overruns: int, last_late: int, said: int | None
) -> None:
    file = run()
    file.cells[FIRST + MODEL.index("overruns")] = overruns
    file.cells[FIRST + MODEL.index("last_late_ns")] = last_late
    figures = Statistics(file.header, file.cells).figures()
    assert figures.models["imu"].last_late_t_ns == said


def test_a_heart_that_has_not_beaten_has_no_age(monkeypatch: pytest.MonkeyPatch) -> None:
    file = run()
    module = "firmware_runtime.statistics.statistics.monotonic_ns"
    monkeypatch.setattr(module, lambda: WRITTEN_AT + LATER)
    statistics = Statistics(file.header, file.cells)
    assert statistics.heartbeat_age_ns == LATER
    file.cells[HEARTBEAT] = 0
    assert statistics.heartbeat_age_ns is None
