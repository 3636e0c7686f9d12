"""An executive around a model, with its make_safe counted, for tests."""

from typing import Any

import pytest

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.statistics import file_header
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.layout import MODEL


class Run:
    """One executive; `made_safe` counts how often the outputs were."""

    def __init__(
        self, model: Component, clock: Clock, configuration: Configuration | None = None
    ) -> None:
        self.made_safe = 0
        self.executive = Executive(model, clock, self._make_safe, configuration or Configuration())

    def until(self, until: int = NEVER) -> Outcome:
        return self.executive.run(until)

    def json(self) -> dict[str, Any]:
        """The statistics as `stats --json` prints them."""
        return self.figures().as_json()

    def figures(self) -> Figures:
        """The statistics; a clock moved by hand stands still while they are read."""
        with pytest.MonkeyPatch.context() as patch:
            if not isinstance(self.executive.clock, MonotonicClock):
                patch.setattr(file_header, "monotonic_ns", lambda: 1)
            return self.executive.statistics.figures()

    def model(self, path: str) -> dict[str, Any]:
        """One model's part of the statistics."""
        statistics: dict[str, Any] = self.json()["models"][path]
        return statistics

    def counts(self, path: str | None = None) -> tuple[int, ...]:
        """How many were scheduled, run, skipped and coalesced, of one model or in total."""
        if path is None:
            statistics = self.json()
            return tuple(statistics[name] for name in MODEL[:4])
        file = self.executive._ledger.file  # as_json takes long in every step
        first = file.layout.model(file.layout.models.index(path))
        return tuple(file.cells[first : first + 4])

    def _make_safe(self) -> list[str]:
        self.made_safe += 1
        return []
