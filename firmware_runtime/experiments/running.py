"""One run of a board in a stage, with the trace of all its ends, for an experiment."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firmware_runtime.board.registry import Board
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.impairment import Impairment
from firmware_runtime.stages.end_process import EndProcess
from firmware_runtime.stages.stage import Stage
from firmware_runtime.stages.staged_run import Staged, run_staged
from firmware_runtime.stages.two_ends import TwoEnds
from firmware_runtime.status import Status
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.until_signal import until_signal

Say = Callable[[str], None]


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


@dataclass(frozen=True, slots=True)
class Traced:
    """A run that ended as it should have: its document, and its trace by time of origin."""

    document: dict[str, Any]
    trace: Path
    shown: str | None
    """The port whose values a person wants to see over time."""

    @property
    def began_s(self) -> float:
        """When the controller's run began, on the time scale of the trace."""
        begins: dict[str, int] = self.document["statistics"].get("begins_ns", {})
        return begins.get("controller", 0) / 1e9


@contextmanager
def traced(setup: Setup, stage: Stage, say: Say) -> Iterator[Traced]:
    """Run it; the trace is there within the block. Raises ConfigError for a run that failed."""
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
        loop_s=setup.loop_s,
    )
    result = run_staged(staged, say, lambda _: None)
    ended = result.document["ended"]
    if result.status != Status.OK:
        raise _failed(stage, f"{ended['by'] or 'stopped'}: {ended['reason']}")
    return Traced(result.document, trace, result.shown)


def _one_process(setup: Setup, stage: Stage, trace: Path, say: Say) -> Traced:
    words = ["run", setup.named, "--stage", stage.value, "--for", f"{setup.for_s:g}"]
    words += ["--doubles", "--trace", str(trace)]
    for assignment in setup.board.assignments:
        words += ["--set", assignment]
    for planned in setup.inputs:
        words += ["--input", planned]
    with until_signal() as signalled:
        ends = TwoEnds(signalled, say, lambda: None)
        try:
            ends.add(end := EndProcess(stage.value, words))
            ends.wait_until(lambda: False)
            document = end.document()
            if ends.failed_first is not None or signalled.came:
                ended = document.get("ended", {"reason": f"status {end.status}"})
                raise _failed(stage, signalled.name or ended["reason"])
            return Traced(document, trace, end.report.get("shown"))
        finally:
            ends.end()
            ends.close()


def _failed(stage: Stage, why: str) -> ConfigError:
    return ConfigError.of_one(f"stage {stage}", f"the run did not reach its end: {why}")
