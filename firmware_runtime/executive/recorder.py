"""The flight recorder's eyes: writes down every function of every model."""

from collections.abc import Callable
from pathlib import Path

from firmware_runtime.devs.functions import Functions
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.spans import GARBAGE, MODELS, STEP, WAKING, SpanRing


class Recorder:
    """Keeps the last `rows` entries."""

    def __init__(self, step: Step, rows: int) -> None:
        self._step = step
        self._rows = rows
        self._record: Callable[[int, int, int], None]

    def open(self, path: Path | None) -> None:
        """From now on, record into the file at `path`. Raises StatisticsFileError."""
        self._record = SpanRing(self._step.paths, self._rows, path).record

    def watch(self, number: int, functions: Functions) -> Functions:
        """Record the functions, timed by the step, of the model with this number."""
        step, track = self._step, MODELS + number

        def recorded(function: Callable[[], None]) -> Callable[[], None]:
            def call() -> None:
                begun = step.lap
                function()
                self._record(track, begun, step.lap)

            return call

        def external(elapsed: int) -> None:
            begun = step.lap
            functions.external(elapsed)
            self._record(track, begun, step.lap)

        confluent = functions.confluent
        return Functions(
            output=recorded(functions.output),
            internal=recorded(functions.internal),
            external=external,
            confluent=None if confluent is None else recorded(confluent),
        )

    def step_ended(self, ended: int) -> None:
        """Record the step under way, and how long it was waited for beyond its instant."""
        step = self._step
        if step.started > step.at:
            self._record(WAKING, step.at, step.started)
        self._record(STEP, step.started, ended)

    def garbage_collected(self, begun: int, ended: int) -> None:
        """Record a collection of garbage."""
        self._record(GARBAGE, begun, ended)
