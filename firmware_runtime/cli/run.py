"""`firmware-runtime run BOARD`: run a robot, on its doubles or on its chips."""

import argparse
import json
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import boards.registry
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chart import chart
from firmware_runtime.cli.session import Session
from firmware_runtime.cli.statistics_text import statistics_text
from firmware_runtime.cli.status import Status
from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.devs.trace import trace
from firmware_runtime.errors import BoardError
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.signals import stop_on_signals
from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.paths import default_path
from firmware_runtime.telemetry.statistics import RunState
from firmware_runtime.telemetry.trace_file import TraceFile


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "run", "Run a robot until its time is up or a signal stops it.", execute)
    add_board(verb)
    verb.add_argument(
        "--doubles", action="store_true", help="run against register-level doubles of its chips"
    )
    verb.add_argument(
        "--clock",
        choices=("monotonic", "virtual", "scaled"),
        default="monotonic",
        help="real time (default); virtual time, as fast as it goes; or real time times --speed",
    )
    verb.add_argument(
        "--speed", type=_positive, metavar="N", help="how many times as fast, with --clock scaled"
    )
    verb.add_argument(
        "--for",
        type=_positive,
        metavar="SECONDS",
        dest="duration_s",
        help="robot time to run for; default on doubles as the board says, else until stopped",
    )
    verb.add_argument(
        "--trace", type=Path, metavar="FILE", help="write every message of every port as JSON lines"
    )
    verb.add_argument(
        "--statistics",
        type=Path,
        metavar="FILE",
        help="where to keep the statistics; default: where `stats` looks, none in virtual time",
    )
    verb.add_argument("--json", action="store_true", help="print result and statistics as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Run the robot; print how it ended."""
    clock = _clock(arguments)
    board = boards.registry.load(arguments.board, arguments.assignments)
    session = Session(
        board, clock, doubles=arguments.doubles, statistics_path=_statistics_path(arguments, board)
    )
    report = Report(session, arguments)
    executive = session.executive
    try:
        with _tracing(session, arguments.trace), stop_on_signals(executive.request_stop):
            report.begin()
            outcome = executive.run(report.until)
        if isinstance(outcome.error, StatisticsFileError):
            raise outcome.error  # the run never began: where to keep its statistics was bad input
        report.end(outcome)
    finally:
        session.close()
    return _status(outcome, session)


class Report:
    """What a run prints: for people as it goes and at its end, or one JSON object at its end."""

    def __init__(self, session: Session, arguments: argparse.Namespace) -> None:
        self._session = session
        self._clock = arguments.clock
        self._json = arguments.json
        duration_s = arguments.duration_s
        if duration_s is None and arguments.doubles:
            duration_s = session.board.doubles_run_s
        self.until = NEVER if duration_s is None else seconds(duration_s)
        self._shown: list[tuple[int, float]] = []
        if not self._json and session.bench is not None:
            port = session.bench.shown
            session.executive.simulator.listen(port, self._remember)

    def begin(self) -> None:
        """Say what runs, for how long, and on what."""
        if self._json:
            return
        board, chips = self._session.board, "doubles" if self._session.bench else "its chips"
        span = "until stopped" if self.until == NEVER else f"for {self.until / 1e9:g} s"
        print(f"{board.name} on {chips}, {self._clock} time, {span}; Ctrl-C stops it", flush=True)
        for warning in board.warnings:
            print(f"warning: {warning}", flush=True)

    def end(self, outcome: Outcome) -> None:
        """Print the result; sentences on what went wrong go to standard error."""
        if outcome.state in {RunState.FAILED, RunState.OVERRUN} or self._session.has_failed:
            print(f"firmware-runtime: {outcome.reason}", file=sys.stderr)
        for fault in outcome.faults:
            print(f"firmware-runtime: not made safe: {fault}", file=sys.stderr)
        for warning in self._session.robot.warnings:
            print(f"firmware-runtime: warning: {warning}", file=sys.stderr)
        if self._json:
            print(json.dumps(self._as_json(outcome), allow_nan=False))
        else:
            print("\n".join(self._as_text()))

    def _as_json(self, outcome: Outcome) -> dict[str, Any]:
        session = self._session
        outputs = {} if session.bench is None else {"outputs_on": session.bench.outputs}
        return {
            "board": session.board.name,
            "clock": self._clock,
            "ended": {"state": outcome.state.name.lower(), "reason": outcome.reason},
            "result": session.result(),
            **outputs,
            "statistics": session.executive.statistics.as_json(),
        }

    def _as_text(self) -> Iterator[str]:
        session = self._session
        if session.bench is not None:
            until = session.world_now()
            yield ""
            yield from chart(self._shown, session.bench.shown.path, until)
        yield ""
        for name, value in session.result().items():
            yield f"{name} {value:.4f}" if isinstance(value, float) else f"{name} {value}"
        if session.bench is not None:
            on = ", ".join(f"{name} {count}" for name, count in session.bench.outputs.items())
            yield f"outputs still on: {on}"
        yield ""
        yield from statistics_text(session.executive.statistics.as_json())

    def _remember(self, at: int, value: object) -> None:
        if isinstance(value, float):
            self._shown.append((at, value))


def _clock(arguments: argparse.Namespace) -> Clock:
    """The clock asked for. Raises BoardError for options that contradict each other."""
    faults = []
    if (arguments.clock == "scaled") != (arguments.speed is not None):
        faults.append("--speed N belongs to --clock scaled, and only to it")
    if arguments.clock != "monotonic" and not arguments.doubles:
        faults.append(f"--clock {arguments.clock} needs --doubles: chips live in real time")
    if faults:
        raise BoardError("run", faults)
    if arguments.clock == "virtual":
        return VirtualClock()
    return ScaledClock(arguments.speed) if arguments.clock == "scaled" else MonotonicClock()


def _statistics_path(arguments: argparse.Namespace, board: boards.registry.Board) -> Path | None:
    if arguments.statistics is not None or arguments.clock == "virtual":
        path: Path | None = arguments.statistics
        return path
    return default_path(board.name)


@contextmanager
def _tracing(session: Session, path: Path | None) -> Iterator[None]:
    with nullcontext() if path is None else TraceFile(path) as file:
        if file is not None:
            trace(session.executive.simulator, file.write)
        yield


def _status(outcome: Outcome, session: Session) -> Status:
    if outcome.faults:
        return Status.NOT_SAFE
    if outcome.state in {RunState.FAILED, RunState.OVERRUN} or session.has_failed:
        return Status.MODEL_ERROR
    if outcome.state is RunState.STOPPED and session.ending is None:
        return Status.INTERRUPTED if outcome.reason == "SIGINT" else Status.TERMINATED
    return Status.OK


def _positive(text: str) -> float:
    """A positive, finite number of the command line."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a positive number")
    return value
