"""What a run prints: for people as it goes and at its end, or one JSON object at its end."""

import argparse
import sys
from collections.abc import Callable, Iterator
from math import isfinite
from typing import TypeVar

from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status, text_of
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.terminal import print_line

T = TypeVar("T")
MOST = 8192
"""Points of a series that are kept."""


class Series:
    """Points are means of as many samples each, at the instant of the first; fewer than `MOST`."""

    def __init__(self) -> None:
        self.points: list[tuple[int, float]] = []
        self._samples_in_point = 1
        self._began_at = 0
        self._sum = 0.0
        self._count = 0

    def add(self, at: int, value: float) -> None:
        """Add one sample; the last few of a long series wait until they make a point."""
        if self._samples_in_point == 1:
            self._add_point(at, value)
            return
        if self._count == 0:
            self._began_at = at
        self._sum += value
        self._count += 1
        if self._count == self._samples_in_point:
            self._add_point(self._began_at, self._sum / self._count)
            self._sum, self._count = 0.0, 0

    def _add_point(self, at: int, value: float) -> None:
        self.points.append((at, value))
        if len(self.points) == MOST:
            self._halve()

    def _halve(self) -> None:
        pairs = zip(self.points[::2], self.points[1::2], strict=True)
        self.points = [(at, (first + second) / 2) for (at, first), (_, second) in pairs]
        self._samples_in_point *= 2


class Report:
    """Begins with what is about to run, ends with how it went.

    `say` prints a sentence to standard error. Only the result, at the very end, waits for a reader.
    A robot or a world that cannot say how the run ended has a defect; all else is printed.
    """

    def __init__(
        self, session: Session, arguments: argparse.Namespace, say: Callable[[str], None]
    ) -> None:
        self._session = session
        self._say = say
        self._clock = arguments.clock
        self._json = arguments.json
        self._stage = arguments.stage
        self._chips = {False: "its chips", True: "doubles"}.get(
            arguments.doubles, f"the doubles at {arguments.doubles}"
        )
        duration_s = arguments.duration_s
        if duration_s is None and arguments.doubles:
            duration_s = session.board.doubles_run_s
        self.until = NEVER if duration_s is None else seconds(duration_s)
        self.defect = Status.OK
        """What such a defect is for the exit status."""
        self._shown = Series()
        if not self._json and session.shown is not None:
            session.executive.simulator.listen(session.shown, self._remember)

    def begin(self) -> None:
        """Say what runs, for how long, and on what."""
        if self._session.replaced is not None:
            self._say(f"{self._session.replaced}; replaced by this run's")
        if self._json:
            return
        board = self._session.board
        span = "until stopped" if self.until == NEVER else f"for {self.until / 1e9:g} s"
        end = self._session.end_of_board
        what = board.name if end is None else f"role {end.role} of {board.name}"
        where = f" on {self._chips}" if self._session.hardware.is_here else ""
        print_line(f"{what}{where}, {self._clock} time, {span}; Ctrl-C stops it", sys.stdout)
        for warning in board.warnings:
            print_line(f"warning: {warning}", sys.stdout)

    def end(self, outcome: Outcome) -> None:
        """Print the result; sentences on what went wrong go to standard error."""
        from firmware_runtime.statistics.summary import periods_not_kept  # noqa: PLC0415 -- at the end

        if self._has_failed(outcome):
            self._say(outcome.reason)
        figures = self._session.executive.statistics.figures()
        for sentence in periods_not_kept(figures):
            self._say(f"warning: {sentence}")
        for fault in outcome.faults:
            self._say(f"not made safe: {fault}")
        for warning in self._session.robot.warnings:
            self._say(f"warning: {warning}")
        if self._json:
            from json import dumps  # noqa: PLC0415 -- as `_as_json`

            print(dumps(self._as_json(outcome, figures), allow_nan=False))
        else:
            print("\n".join(self._as_text(outcome, figures)))

    def _has_failed(self, outcome: Outcome) -> bool:
        return outcome.state in {RunState.FAILED, RunState.OVERRUN} or self._session.task.has_failed

    def _as_json(self, outcome: Outcome, figures: Figures) -> dict[str, object]:
        # a run that is printed for people starts without
        from firmware_runtime.lab.stages.document import of_one_process  # noqa: PLC0415
        from firmware_runtime.statistics.json_values import plain  # noqa: PLC0415

        session = self._session
        outputs_on = self._asked(session.outputs)
        document = {
            "board": session.board.name,
            "clock": self._clock,
            "ended": {"state": outcome.state.name.lower(), "reason": outcome.reason},
            "result": plain(self._asked(session.result)),
            **({} if outputs_on is None else {"outputs_on": outputs_on}),
            "statistics": (statistics := figures.as_json()),
            **({"link": statistics["link"]} if "link" in statistics else {}),
        }
        return document if self._stage is None else of_one_process(self._stage, document)

    def _as_text(self, outcome: Outcome, figures: Figures) -> Iterator[str]:
        # nothing that is printed at the end is loaded before a run
        from firmware_runtime.cli.terminal_chart import chart  # noqa: PLC0415
        from firmware_runtime.statistics.run_text import statistics_text  # noqa: PLC0415
        from firmware_runtime.statistics.summary import outputs_text  # noqa: PLC0415

        session = self._session
        if self._has_failed(outcome):
            yield f"failed: {outcome.reason}"
        elif session.arming is not None and not session.arming.was_armed:
            yield f"never armed, so nothing was driven: {session.arming.reason}"
        if session.shown is not None:
            yield ""
            yield from chart(self._shown.points, session.shown.path, session.hardware.world_now())
        yield ""
        for name, value in (self._asked(session.result) or {}).items():
            yield f"{name} {value:.4f}" if isinstance(value, float) else f"{name} {value}"
        outputs_on = self._asked(session.outputs)
        if outputs_on is not None:
            yield outputs_text(outputs_on)
        yield ""
        yield from statistics_text(figures)
        if (recorded := session.edge.said) is not None:
            yield f"  recorded in {recorded}"

    def _asked(self, what: Callable[[], T]) -> T | None:
        try:
            return what()
        except FirmwareRuntimeError as error:
            self._say(text_of(error))
            is_package = isinstance(error, ConfigError)
            self.defect = Status.BAD_INPUT if is_package else Status.MODEL_ERROR
            return None

    def _remember(self, at: int, value: object) -> None:
        if isinstance(value, float) and isfinite(value):  # a sonar without an echo says inf
            self._shown.add(at, value)
