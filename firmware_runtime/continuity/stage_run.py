"""One stage of a board as a process of its own: recorded, then replayed and compared."""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from firmware_runtime.board.registry import Board
from firmware_runtime.continuity.signals import quantiles_us
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.comparison import Comparison
from firmware_runtime.recording.of_board import replay_of
from firmware_runtime.recording.recording import Recording, read_recording

SIMULATION: Final = "simulation"
EMBEDDED: Final = "embedded"
STAGES: Final = (SIMULATION, EMBEDDED)
"""In the order in which a robot comes about."""
_AT_LEAST_S: Final = 120.0
_TIMES: Final = 10.0
_END_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What each stage runs; `named` is the board as the command line has it."""

    board: Board
    named: str
    for_s: float

    def words(self, stage: str, folder: Path) -> list[str]:
        """The command line of a stage."""
        words = ["run", self.named, "--doubles", "--for", f"{self.for_s:g}", "--json"]
        words += ["--clock", "virtual" if stage == SIMULATION else "monotonic"]
        words += ["--record", str(recording_in(folder, stage))]
        words += ["--statistics", str(folder / f"{stage}.stats")]
        for assignment in self.board.assignments:
            words += ["--set", assignment]
        return words


@dataclass(frozen=True, slots=True)
class StageRun:
    """What became of a stage; `why_not` says that it did not run, and why."""

    stage: str
    why_not: str | None = None
    comparison: Comparison | None = None
    recording: Recording | None = None
    robot: Recording | None = None
    """That of the other end, in a stage of two ends."""
    document: Mapping[str, Any] = field(default_factory=dict)
    """What `run --json` printed."""
    failed: str | None = None
    """How the run went wrong, if it did, whatever its replay is."""

    @property
    def has_run(self) -> bool:
        """Whether it was run and compared."""
        return self.comparison is not None

    @property
    def ages_us(self) -> dict[str, dict[str, float]] | None:
        """How old samples were when they entered; None where no link was between."""
        return None if self.recording is None else quantiles_us(self.recording)

    @property
    def is_equal(self) -> bool:
        """Whether the run ended well and every output event is that of the replay."""
        return self.comparison is not None and self.comparison.is_equal and self.failed is None


def recording_in(folder: Path, stage: str) -> Path:
    """Where a stage's recording is kept."""
    return folder / f"{stage}.recording"


def run_stage(plan: Plan, stage: str, folder: Path) -> StageRun:
    """Run a stage to its end, and its replay. A stage that this machine cannot run says why."""
    words = [sys.executable, "-m", "firmware_runtime.cli", *plan.words(stage, folder)]
    patience = max(_AT_LEAST_S, _TIMES * plan.for_s)
    with _process(words) as process:
        try:
            out, error = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            return StageRun(stage, f"it did not end within {patience:g} s")
    document = _document(out)
    try:
        recording = read_recording(recording_in(folder, stage))
        comparison = replay_of(recording, plan.board)
    except ConfigError as fault:
        return StageRun(stage, _last_line(error) or str(fault))
    failed = _failed(process.returncode, document, error)
    return StageRun(
        stage, None, comparison, recording, robot=None, document=document, failed=failed
    )


@contextmanager
def _process(words: Sequence[str]) -> Iterator["subprocess.Popen[str]"]:
    """A process that is over when the block is, however that ends."""
    process = subprocess.Popen(  # noqa: S603 -- this project's own command
        words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()  # outputs go off; what is held up by that is killed
            try:
                process.communicate(timeout=_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()


def _document(out: str) -> dict[str, Any]:
    try:
        document = json.loads(out)
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}


def _failed(status: int, document: Mapping[str, Any], error: str) -> str | None:
    if status == 0:
        return None
    ended = document.get("ended", {})
    reason = ended.get("reason") or _last_line(error) or "it said nothing"
    return f"the run ended with status {status}: {reason}"


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].removeprefix("firmware-runtime: ") if lines else ""
