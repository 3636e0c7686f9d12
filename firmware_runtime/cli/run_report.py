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
from firmware_runtime.system.terminal import is_same_place, print_line

T = TypeVar("T")
MOST = 8192
"""Points of a series that are kept."""


class Series:
    """Points are means of as many samples each, at the instant of the first; fewer than `MOST`."""

    def __init__(self) -> None:
        self.points: list[tuple[int, float]] = []
        self.last: float | None = None
        """The newest sample; None before the first."""
        self._samples_in_point = 1
        self._began_at = 0
        self._sum = 0.0
        self._count = 0

    def add(self, at: int, value: float) -> None:
        """Add one sample; the last few of a long series wait until they make a point."""
        self.last = value
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
    """Begins with what is about to run, ends with how it went, in lines that `closing_text` makes.

    `say` prints a sentence to standard error. Only the result, at the very end, waits for a reader.
    What went wrong is among its lines, and on standard error unless both are the same terminal.
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
        self._statistics = arguments.statistics
        self._chips = {False: "its chips", True: "doubles"}.get(
            arguments.doubles, f"the doubles at {arguments.doubles}"
        )
        duration_s = arguments.duration_s
        if duration_s is None and arguments.doubles:
            duration_s = session.board.doubles_run_s
        self.until = NEVER if duration_s is None else seconds(duration_s)
        self.defect = Status.OK
        """What such a defect is for the exit status."""
        self._defects: list[str] = []
        self._shown = self._series()

    def begin(self) -> None:
        """Say what runs, for how long, and on what."""
        if self._session.replaced is not None:
            self._say(f"{self._session.replaced}; replaced by this run's")
        if self._json:
            return
        board = self._session.board
        span = "until stopped" if self.until == NEVER else f"for {self.until / 1e9:g} s"
        where = f" on {self._chips}" if self._session.hardware.is_here else ""
        print_line(f"{self._what}{where}, {self._clock} time, {span}; Ctrl-C stops it", sys.stdout)
        for warning in board.warnings:
            print_line(f"warning: {warning}", sys.stdout)

    def end(self, outcome: Outcome) -> None:
        """Print the result; what went wrong goes to standard error, too."""
        figures = self._session.executive.statistics.figures()
        if self._json:
            from json import dumps  # noqa: PLC0415 -- as `_as_json`

            document = self._as_json(outcome, figures)
            self._say_aside(outcome, figures)
            print(dumps(document, allow_nan=False))
        else:
            lines = list(self._as_text(outcome, figures))
            if not is_same_place(sys.stdout, sys.stderr):
                self._say_aside(outcome, figures)
            print("\n".join(lines))

    def _say_aside(self, outcome: Outcome, figures: Figures) -> None:
        """Say on standard error what went wrong."""
        from firmware_runtime.statistics.summary import periods_not_kept  # noqa: PLC0415 -- at the end

        if self._has_failed(outcome):
            self._say(outcome.sentence)
        for sentence in self._defects:
            self._say(sentence)
        for sentence in (*periods_not_kept(figures), *self._session.robot.warnings):
            self._say(f"warning: {sentence}")
        for fault in outcome.faults:
            self._say(f"not made safe: {fault}")

    def _has_failed(self, outcome: Outcome) -> bool:
        return outcome.state in {RunState.FAILED, RunState.OVERRUN} or self._session.task.has_failed

    def _as_json(self, outcome: Outcome, figures: Figures) -> dict[str, object]:
        # a run that is printed for people starts without
        from firmware_runtime.lab.stages.document import of_one_process  # noqa: PLC0415
        from firmware_runtime.statistics.json_values import plain  # noqa: PLC0415

        session = self._session
        outputs_on = self._asked(session.outputs)
        kept = session.edge.kept
        document = {
            "board": session.board.name,
            "clock": self._clock,
            "ended": {"state": outcome.state.name.lower(), "reason": outcome.reason},
            "result": plain(self._asked(session.result)),
            **({} if outputs_on is None else {"outputs_on": outputs_on}),
            **({"recording": str(kept)} if kept is not None and kept.exists() else {}),
            "statistics": (statistics := figures.as_json()),
            **({"link": statistics["link"]} if "link" in statistics else {}),
        }
        return document if self._stage is None else of_one_process(self._stage, document)

    # For people --------------------------------------------------------------------------------

    @property
    def _what(self) -> str:
        """The robot, or the end of one."""
        end, name = self._session.end_of_board, self._session.board.name
        return name if end is None else f"role {end.role} of {name}"

    def _as_text(self, outcome: Outcome, figures: Figures) -> Iterator[str]:
        # nothing that is printed at the end is loaded before a run
        from firmware_runtime.statistics.closing_text import (  # noqa: PLC0415
            closing_lines,
            punctuality,
        )

        yield ""
        if self._shown is not None and (drawn := self._chart(self._shown)):
            yield from drawn
            yield ""
        did = [*self._did(outcome, figures)]
        outputs = self._outputs(outcome)
        wrong = [*self._went_wrong(outcome, figures)]
        rest = [*outputs, punctuality(figures), *self._where_to_go_on()]
        yield from closing_lines(did, wrong, rest)

    def _chart(self, shown: Series) -> list[str]:
        from firmware_runtime.cli.terminal_chart import chart  # noqa: PLC0415 -- as above

        session = self._session
        label = "" if session.shown is None else session.shown.path
        return chart(shown.points, label, session.hardware.world_now())

    def _did(self, outcome: Outcome, figures: Figures) -> Iterator[str]:
        """What the robot did, by the board's words if it has some; and what stopped it, if so."""
        from firmware_runtime.statistics.closing_text import did_text, stopped_text  # noqa: PLC0415

        session, ending = self._session, self._session.task.ending
        result = self._asked(session.result) or {}
        board_says = session.board.result_text
        words = (
            None if not result or board_says is None else self._asked(lambda: board_says(result))
        )
        if words is None:
            last = None if ending is None or ending.failed else ending.reason
            yield did_text(self._what, figures, last, result or self._last_shown())
        else:
            yield words
        is_by_task = ending is not None and session.linked is None
        if outcome.state is RunState.STOPPED and not is_by_task:
            yield stopped_text(figures, outcome.reason)

    def _last_shown(self) -> dict[str, object]:
        """The last value of the port that is shown, for a robot without another result."""
        if self._shown is None or self._shown.last is None or self._session.shown is None:
            return {}
        return {self._session.shown.name: self._shown.last}

    def _went_wrong(self, outcome: Outcome, figures: Figures) -> Iterator[str]:
        from firmware_runtime.statistics.closing_text import went_wrong  # noqa: PLC0415 -- as above

        session = self._session
        yield from (f"not made safe: {fault}" for fault in outcome.faults)
        if self._has_failed(outcome):
            yield f"failed: {outcome.sentence}"
        elif session.arming is not None and not session.arming.was_armed:
            yield f"never armed, so nothing was driven: {session.arming.reason}"
        yield from self._defects
        yield from (f"warning: {sentence}" for sentence in session.robot.warnings)
        yield from went_wrong(figures, drives_outside=session.hardware.is_outside)

    def _outputs(self, outcome: Outcome) -> Iterator[str]:
        """Whether all outputs are off; nothing of an end that has none."""
        from firmware_runtime.statistics.closing_text import outputs_text  # noqa: PLC0415 -- as above

        session = self._session
        on = self._asked(session.outputs)
        if on or (session.hardware.is_here and session.robot.stop):
            yield outputs_text(on, not_safe=bool(outcome.faults))

    def _where_to_go_on(self) -> Iterator[str]:
        """Where the run is recorded, and the verbs that show more of it."""
        from firmware_runtime.statistics.closing_text import next_text  # noqa: PLC0415 -- as above

        session, end = self._session, self._session.end_of_board
        recorded = session.edge.said
        if recorded is not None:
            yield f"recorded in {recorded}"
        name = session.board.name if end is None else end.name
        stated, is_virtual = self._statistics, self._clock == "virtual"
        run = name if stated is None else str(session.edge.kept)
        statistics = None if is_virtual and stated is None else str(stated or name)
        yield from next_text(None if recorded is None else run, statistics)

    def _asked(self, what: Callable[[], T]) -> T | None:
        try:
            return what()
        except FirmwareRuntimeError as error:
            self._defects.append(text_of(error))
            is_package = isinstance(error, ConfigError)
            self.defect = Status.BAD_INPUT if is_package else Status.MODEL_ERROR
            return None

    def _series(self) -> Series | None:
        """What the shown port sends, for the chart; None where nothing is drawn."""
        shown = None if self._json else self._session.shown
        if shown is None:
            return None
        series = Series()

        def remember(at: int, value: object) -> None:
            if isinstance(value, float) and isfinite(value):  # a sonar without an echo says inf
                series.add(at, value)

        self._session.executive.simulator.listen(shown, remember)
        return series
