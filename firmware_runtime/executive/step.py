"""One step: the instant being worked off, and what each model has spent in it."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.statistics.spans import STEP, WAKING, SpanRing

Record: TypeAlias = Callable[[int, int, int], None]
"""The flight recorder's: track, begin and end, instants in ns."""


class Step:
    """The instant under way, and what divides its time among the models.

    `at` is the instant of the run it stands for, `started` what the clock read when it began, and
    `lap` what it read when the last model's function returned. The time from one lap to the next is
    the own time of the model whose function returned: the clock is read once a function, and own
    times, one for each model in order of declaration, add up to the time of the step. `began_at` is
    when each model's output function began, the last time it did. `touched` are the models that
    have left something to count after the step, by number. `record` is there while the flight
    recorder is open. `takes_time` is False where the clock stands still during a step and nothing
    is recorded.
    """

    def __init__(self, now: Callable[[], int], *, takes_time: bool = True) -> None:
        self.takes_time = takes_time
        self.at = 0
        self.started = 0
        self.lap = 0
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self.began_at: list[int] = []
        self.touched: list[int] = []
        self.record: Record | None = None
        self.now = now
        self._zeros: list[int] = []

    def join(self, component: Component) -> int:
        """Give a model its place, in order of declaration; return its number."""
        self.paths.append(below_root(component.path))
        for column in (self.own_times, self.began_at, self._zeros):
            column.append(0)
        return len(self.paths) - 1

    def open_recorder(self, rows: int, path: Path) -> None:
        """From now on, keep the last `rows` entries in the file at `path`.

        Raises StatisticsFileError.
        """
        self.record = SpanRing(self.paths, rows, path).record

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.lap = self.started = self.now()
        self.at = at
        self.own_times[:] = self._zeros

    def end(self, ended: int) -> None:
        """Record the step under way, and how long it was waited for beyond its instant."""
        if self.record is not None:
            if self.started > self.at:
                self.record(WAKING, self.at, self.started)
            self.record(STEP, self.started, ended)
