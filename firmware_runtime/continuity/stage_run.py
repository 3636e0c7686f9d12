"""One stage of a board as a process of its own: recorded, then replayed and compared."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER, ROBOT
from firmware_runtime.continuity.signals import quantiles_us
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.part_recording.of_board import replay_of
from firmware_runtime.part_recording.recording import Recording, read_recording
from firmware_runtime.stages.stage import Stage
from firmware_runtime.stages.staged_run import beside
from firmware_runtime.status import Status
from firmware_runtime.system.own_folder import own_folder

_CANNOT: Final = (Status.BAD_INPUT, Status.NO_DEVICE, Status.REFUSED)
"""Exit statuses of a run that this machine or this board does not allow."""
_AT_LEAST_S: Final = 120.0
_TIMES: Final = 10.0
_END_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What each stage runs; `named` is the board as the command line has it."""

    board: Board
    named: str
    for_s: float
    impair: str | None = None
    """What stage remote's network does, in the words of `run --impair`; None: its default."""
    link: str | None = None
    """What stage network's ends are linked by, in the words of `run --link`; None: its default."""

    def words(self, stage: Stage, folder: Path) -> list[str]:
        """The command line of a stage, on doubles."""
        words = ["run", self.named, "--stage", stage.value, "--for", f"{self.for_s:g}", "--json"]
        words += ["--record", str(recording_in(folder, stage))]
        words += ["--doubles"] if stage is Stage.EMBEDDED else []
        if stage is Stage.REMOTE and self.impair is not None:
            words += ["--impair", self.impair]
        if stage is Stage.NETWORK and self.link is not None:
            words += ["--link", self.link]
        for assignment in self.board.assignments:
            words += ["--set", assignment]
        return words


@dataclass(frozen=True, slots=True)
class StageRun:
    """What became of a stage; `why_not` says that it cannot be run here, and why.

    One that should have run and left nothing has `failed` and no comparison.
    """

    stage: Stage
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
        return self.why_not is None

    @property
    def controller_began_s(self) -> float:
        """When the controller began by the robot end's time, s, in a stage of two ends."""
        begins = self.document.get("statistics", {}).get("begins_ns", {})
        later: int = begins.get(CONTROLLER, 0) - begins.get(ROBOT, 0)
        return later / SECOND

    @property
    def ages_us(self) -> dict[str, dict[str, float]] | None:
        """How old samples were when they entered; None where no link was between."""
        return None if self.recording is None else quantiles_us(self.recording)

    @property
    def is_equal(self) -> bool:
        """Whether the run ended well and every output event is that of the replay."""
        return self.comparison is not None and self.comparison.is_equal and self.failed is None


def recording_in(folder: Path, stage: Stage) -> Path:
    """Where a stage's recording is kept."""
    return folder / f"{stage}.recording"


def run_stage(plan: Plan, stage: Stage, folder: Path) -> StageRun:
    """Run a stage to its end, and its replay. A stage that this machine cannot run says why."""
    timeout = max(_AT_LEAST_S, _TIMES * plan.for_s)
    with _process(plan.words(stage, folder)) as process:
        try:
            out, error = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            return StageRun(stage, failed=f"it did not end within {timeout:g} s")
    document = _document(out)
    try:
        recording = read_recording(recording_in(folder, stage))
        comparison = replay_of(recording, plan.board)
    except ConfigError as fault:
        said = _last_line(error) or str(fault)
        if process.returncode in _CANNOT:
            return StageRun(stage, said)
        return StageRun(stage, document=document, failed=said)
    failed = _failed(process.returncode, document, error)
    robot = _robot_end(folder, stage)
    return StageRun(stage, None, comparison, recording, robot, document, failed)


@contextmanager
def _process(words: Sequence[str]) -> Iterator["subprocess.Popen[str]"]:
    """The command in a process that is over when the block is, however that ends.

    Its statistics and sockets have a place of their own: a robot of this name may be running here.
    """
    with own_folder() as state:
        process = subprocess.Popen(  # noqa: S603 -- this project's own command
            [sys.executable, "-m", "firmware_runtime.cli", *words],
            env=os.environ | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(state)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            process_group=0,  # Ctrl-C is for the command; it ends this one
        )
        try:
            yield process
        finally:
            _end(process)


def _end(process: "subprocess.Popen[str]") -> None:
    """Let it switch its outputs off and end; what is held up by that is killed."""
    if process.poll() is None:
        process.terminate()
        try:
            process.communicate(timeout=_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _robot_end(folder: Path, stage: Stage) -> Recording | None:
    """The robot end's recording, for what it shows; None in a stage of one process."""
    try:
        return read_recording(beside(recording_in(folder, stage)))
    except ConfigError:
        return None


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
