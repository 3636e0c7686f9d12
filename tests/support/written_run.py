"""A statistics file as a run might have left it, without the run."""

from collections.abc import Sequence
from pathlib import Path

from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.history import COUNTED, Timeline, WorstList
from firmware_runtime.statistics.layout import (
    CPU,
    ELAPSED,
    MODEL,
    STATE,
    STEP_HISTOGRAM,
    WORST,
    Layout,
)
from firmware_runtime.statistics.statistics import Statistics

LAYOUT = Layout(
    models=("imu", "compass"),
    timed=("imu", "compass", "thrust"),
    buses=("i2c1",),
    deadlines=("imu.sample -> thrust",),
)
SETTINGS = {
    "fifo_priority": {
        "asked": 60,
        "granted": False,
        "reason": "Operation not permitted; needs CAP_SYS_NICE",
    },
    "lock_memory": {"asked": True, "granted": True, "reason": None},
    "spin_us": {"asked": 0.0, "granted": False, "reason": "not asked for"},
}


class WrittenRun:
    """Counts what it is given and keeps the timeline, one activation of `imu` at a time."""

    def __init__(
        self, layout: Layout = LAYOUT, path: Path | None = None, **conditions: object
    ) -> None:
        stated = {"period_ns": 10 * MILLISECOND, "tolerance_ns": MILLISECOND, "policy": "skip"}
        header = {
            "models": dict.fromkeys(layout.models, stated),
            "conditions": {"board": "robot", "settings": SETTINGS, **conditions},
        }
        self.file = StatisticsFile(layout, header, path)
        self.cells = self.file.cells
        self._counters = [0] * len(COUNTED)
        self._timeline = Timeline(self.cells[layout.timeline], lambda: self._counters)
        self._worst = WorstList(self.cells, layout)

    def activation(self, at: int, lateness: int, step: int, *, skipped: int = 0) -> None:
        """One that was due at an instant, began so late, and whose step took so long."""
        if at >= self._timeline.closes_at:
            self._timeline.close(at)
        late = int(lateness > MILLISECOND)
        self._grow("activations", 1)
        self._grow("late", late)
        self._grow("skipped", skipped)
        self._grow("lateness_ns", lateness)
        self._grow("steps", 1)
        self._grow("cpu_ns", step)
        self._grow("bus_ns", 2 * step)
        self._timeline.lateness_max = max(self._timeline.lateness_max, lateness)
        self._timeline.step_max = max(self._timeline.step_max, step)
        Histogram(self.cells[self.file.layout.lateness(0)]).record(lateness)
        for place in (STEP_HISTOGRAM, self.file.layout.step(0)):
            Histogram(self.cells[place]).record(step)
        for name, grown in zip(MODEL, (1 + skipped, 1, skipped, 0, late, late), strict=False):
            self.cells[self.file.layout.model(0) + MODEL.index(name)] += grown
        self.elapsed = at + lateness + step

    @property
    def elapsed(self) -> int:
        """How far the run has come, in ns."""
        return self.cells[ELAPSED]

    @elapsed.setter
    def elapsed(self, now: int) -> None:
        self.cells[ELAPSED] = now

    def keep(self, own_times: Sequence[int], devices: Sequence[int] = (), **fields: int) -> None:
        """Put an activation among the worst: fields of `WORST` by name, in ns."""
        row = [fields.get(name, 0) for name in WORST]
        self._worst.keep([*row, *own_times, *devices, *[0] * (16 - len(devices))])

    def statistics(
        self, state: RunState = RunState.RUNNING, *, alive: bool = True, complete: bool = True
    ) -> Statistics:
        """What a reader would see now."""
        if state is not RunState.RUNNING:
            self._timeline.close(self.elapsed)
        self.cells[STATE] = state
        self.cells[CPU] = self._counters[COUNTED.index("cpu_ns")]
        return replace(self.file.statistics(), writer_alive=alive, complete=complete)

    def _grow(self, name: str, by: int) -> None:
        self._counters[COUNTED.index(name)] += by


def uneven_run(seconds: int = 200) -> WrittenRun:
    """A run of ten activations a second: one stall of half a second, else late by microseconds."""
    run = WrittenRun()
    for number in range(10 * seconds):
        stalled = number == 57
        lateness = 500 * MILLISECOND if stalled else 20_000 + number % 100 * 997
        run.activation(number * SECOND // 10, lateness, 300_000, skipped=4 if stalled else 0)
    run.keep(
        [250_000, 0, 40_000],
        [0x68, 0, 0, 0, 0, 0, 0, 0, 592_500],
        t_ns=5_700 * MILLISECOND,
        lateness_ns=500 * MILLISECOND,
        step_ns=300_000,
        wake_ns=450 * MILLISECOND,
        behind_ns=50 * MILLISECOND,
        garbage_ns=70_000,
    )
    return run
