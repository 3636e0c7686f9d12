"""One run of a board in a stage, with the trace of all its ends, for an experiment."""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.end_process import EndProcess
from firmware_runtime.lab.stages.stage import Stage
from firmware_runtime.lab.stages.staged_run import Staged, run_staged
from firmware_runtime.lab.stages.two_ends import TwoEnds
from firmware_runtime.links.cut.impairment import Impairment
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.signals import UntilSignal, status_by, until_signal

Say = Callable[[str], None]
Points: TypeAlias = list[tuple[float, float]]
"""Seconds, and a value; in order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """What is run; `board` as it was read, `named` as the command line has it."""

    board: Board
    named: str
    for_s: float
    how: Impairment
    is_over_ros: bool = False
    inputs: Sequence[str] = ()
    peer: str | None = None
    key: Path | None = None
    loop_s: float | None = None
    """The period of the loop that is run in place of the board's model."""
    record: Path | None = None
    """Where the controller's recording is kept; the robot end's beside it."""
    is_drawn: bool = False
    """Whether the rig draws the run, in a stage of one process."""


@dataclass(frozen=True, slots=True)
class Traced:
    """A run that ended as it should have: its document, and its trace by time of origin."""

    document: dict[str, Any]
    trace: Path
    shown: str | None
    """The port whose values a person wants to see over time."""
    recording: Path | None = None
    """Of the run, or its controller's end, for `replay`; None for a loop in place of the board."""
    picture: str = ""
    """The run as the rig draws it, SVG; empty where that was not asked for."""
    senders: Senders | None = None
    """Which ports send what leaves a coupled model's; None where ports of atomics are named."""

    @property
    def began_s(self) -> float:
        """When the controller's run began, on the time scale of the trace."""
        begins: dict[str, int] = self.document["statistics"].get("begins_ns", {})
        return begins.get(CONTROLLER, 0) / SECOND

    def points(self, port: str, *keys: str | int) -> Points:
        """What a port sent: seconds since the controller began, and the value.

        `keys` lead to a number in it, such as `"rate"`, or `"field", 0`. Values before the
        controller began, in a stage of two ends, have negative instants.
        """
        began_s, found = self.began_s, []
        for message in self.messages(port):
            value = message["value"]
            for key in keys:
                value = value[key]
            found.append((message["t_ns"] / SECOND - began_s, float(value)))
        return found

    def messages(self, *ports: str) -> Iterator[dict[str, Any]]:
        """The lines of the trace that are of these ports, or of those that send through them."""
        if self.senders is not None:
            ports = tuple(sent for port in ports for sent in self.senders.of(port))
        with self.trace.open() as file:
            for line in file:
                message = json.loads(line)
                if message["port"] in ports:
                    yield message


@contextmanager
def traced(setup: Setup, stage: Stage, say: Say) -> Iterator[Traced]:
    """Run it; the trace is there within the block.

    Raises ConfigError for a run that failed, SystemExit for one that a signal stopped.
    """
    with own_folder() as folder:
        trace = folder / "trace.jsonl"
        if stage.has_two_ends:
            yield _two_ends(setup, stage, trace, say)
        else:
            yield _one_process(setup, stage, trace, say)


def _two_ends(setup: Setup, stage: Stage, trace: Path, say: Say) -> Traced:
    staged = Staged(
        board=setup.board,
        named=setup.named,
        stage=stage,
        for_s=setup.for_s,
        how=setup.how,
        peer=setup.peer,
        key=setup.key,
        is_over_ros=setup.is_over_ros,
        inputs=setup.inputs,
        trace=trace,
        record=setup.record,
        loop_s=setup.loop_s,
    )
    result = run_staged(staged, say, lambda _: None)
    ended = result.document["ended"]
    if result.status in {Status.INTERRUPTED, Status.TERMINATED}:
        raise SystemExit(result.status)
    if result.status != Status.OK:
        raise _failed(stage, f"{ended['by'] or 'stopped'}: {ended['reason']}")
    return Traced(result.document, trace, result.shown, setup.record, senders=_senders(setup.board))


def _one_process(setup: Setup, stage: Stage, trace: Path, say: Say) -> Traced:
    with until_signal() as signalled:
        ends = TwoEnds(signalled, say, lambda: None)
        try:
            ends.add(end := EndProcess(stage.value, _words(setup, stage, trace)))
            ends.wait_until(lambda: False)
            document = end.document()
            _check(ends, end, signalled, stage)
            shown = end.report.get("shown")
            picture = _picture(trace).read_text("utf-8") if setup.is_drawn else ""
            return Traced(document, trace, shown, setup.record, picture, _senders(setup.board))
        finally:
            ends.end()
            ends.close()


def _senders(board: Board) -> Senders:
    return Senders(board.unconnected().model)


def _words(setup: Setup, stage: Stage, trace: Path) -> list[str]:
    """The command of a run in one process, on doubles."""
    words = ["run", setup.named, "--stage", stage.value, "--for", f"{setup.for_s:g}"]
    words += ["--doubles", "--trace", str(trace)]
    for assignment in setup.board.assignments:
        words += ["--set", assignment]
    for planned in setup.inputs:
        words += ["--input", planned]
    words += ["--plot", str(_picture(trace))] if setup.is_drawn else []
    return words if setup.record is None else [*words, "--record", str(setup.record)]


def _picture(trace: Path) -> Path:
    """Where the picture of a run is, beside its trace."""
    return trace.with_suffix(".svg")


def _check(ends: TwoEnds, end: EndProcess, signalled: UntilSignal, stage: Stage) -> None:
    """Raise what became of a run that did not reach its end."""
    if signalled.came:
        raise SystemExit(status_by(signalled.name))
    if ends.failed_first is not None:
        ended = end.document().get("ended", {"reason": f"status {end.status}"})
        raise _failed(stage, ended["reason"])


def _failed(stage: Stage, why: str) -> ConfigError:
    return ConfigError.of_one(f"stage {stage}", f"the run did not reach its end: {why}")
