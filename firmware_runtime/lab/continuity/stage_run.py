"""One stage of a board as a process of its own: recorded, then replayed and compared."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from firmware_runtime.board.assignments import set_words
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER, ROBOT
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.stage import Stage
from firmware_runtime.lab.stages.staged_run import beside
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.difference import Difference
from firmware_runtime.recording.replay.verdict import Verdict, replay
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
        return words + set_words(self.board.assignments)


@dataclass(frozen=True, slots=True)
class End:
    """What one process of a stage recorded, and the verdict of its replay."""

    recording: Recording
    verdict: Verdict

    @property
    def is_identical(self) -> bool | None:
        """Whether the whole run is its replay; None where that could not all be compared."""
        if self.recording.is_from_start or self.verdict.is_identical is False:
            return self.verdict.is_identical
        return None

    @property
    def fault(self) -> str | None:
        """Why it is not shown that the whole run is its replay, a sentence; None if it is."""
        if self.verdict.is_identical is False:
            return self.verdict.reason
        if not self.recording.is_from_start:
            begin = self.recording.segments()[0].first_at / SECOND
            room = "expected a shorter run, or more recording.minutes"
            return (
                f"its beginning was written over, and only what follows {begin:g} s is left; {room}"
            )
        return self.verdict.reason


@dataclass(frozen=True, slots=True)
class StageRun:
    """What became of a stage; `why_not` says that it cannot be run here, and why.

    One that should have run and left nothing has `failed` and no ends.
    """

    stage: Stage
    why_not: str | None = None
    ends: Mapping[str, End] = field(default_factory=dict)
    """By role, or `whole` for a stage of one process."""
    document: Mapping[str, Any] = field(default_factory=dict)
    """What `run --json` printed."""
    failed: str | None = None
    """How the run went wrong, if it did, whatever its replay is."""

    @property
    def has_run(self) -> bool:
        """Whether it was run."""
        return self.why_not is None

    @property
    def controller_began_s(self) -> float:
        """When the controller began by the robot end's time, s, in a stage of two ends."""
        begins = self.document.get("statistics", {}).get("begins_ns", {})
        later: int = begins.get(CONTROLLER, 0) - begins.get(ROBOT, 0)
        return later / SECOND

    @property
    def is_identical(self) -> bool | None:
        """Whether the run ended well, and each end is its replay; None as for an end."""
        if self.failed is not None or not self.ends:
            return False
        return all_of(end.is_identical for end in self.ends.values())

    @property
    def fault(self) -> str | None:
        """What keeps it from that, a sentence; None if nothing does."""
        if self.failed is not None:
            return self.failed
        ends = ((role, end.fault) for role, end in self.ends.items())
        said = [f"{role}: {fault}" for role, fault in ends if fault is not None]
        return "; ".join(said) or None

    @property
    def events(self) -> int:
        """Values that left ports, at all ends."""
        return sum(end.verdict.events for end in self.ends.values())

    @property
    def values(self) -> int:
        """Of these, the robot's own: those of a world on doubles are played back."""
        return sum(end.verdict.values for end in self.ends.values())

    @property
    def compared(self) -> int:
        """Of the robot's own values, those that were compared as a whole."""
        return sum(end.verdict.compared for end in self.ends.values())

    @property
    def differences(self) -> int:
        """Whatever is not the same in the replays of all ends."""
        return sum(end.verdict.differences for end in self.ends.values())

    @property
    def first_difference(self) -> Difference | None:
        """The first, of the first end that has one."""
        return next((each.verdict.first for each in self.ends.values() if each.verdict.first), None)


def all_of(found: Iterable[bool | None]) -> bool | None:
    """False if any is, else None if any is, else True."""
    every = list(found)
    return False if False in every else None if None in every else True


def recording_in(folder: Path, stage: Stage) -> Path:
    """Where a stage's recording is kept: the controller's in a stage of two ends."""
    return folder / f"{stage}.recording"


def run_stage(plan: Plan, stage: Stage, folder: Path) -> StageRun:
    """Run a stage to its end, then replay it. A stage that this machine cannot run says why."""
    timeout = max(_AT_LEAST_S, _TIMES * plan.for_s)
    path = recording_in(folder, stage)
    for each in (path, beside(path)):
        each.unlink(missing_ok=True)  # of another run, in a folder that is kept
    with _process(plan.words(stage, folder)) as process:
        try:
            out, error = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            return StageRun(stage, failed=f"it did not end within {timeout:g} s")
    document = _document(out)
    try:
        ends = _ends(stage, path)
    except ConfigError as fault:
        said = _last_line(error) or str(fault)
        if process.returncode in _CANNOT:
            return StageRun(stage, said)
        return StageRun(stage, document=document, failed=said)
    failed = _failed(process.returncode, document, error)
    return StageRun(stage, None, ends, document, failed)


def _ends(stage: Stage, path: Path) -> dict[str, End]:
    """Every process of the stage, replayed. Raises ConfigError for a recording that is missing."""
    if not stage.has_two_ends:
        return {"whole": _end_of(path)}
    return {CONTROLLER: _end_of(path), ROBOT: _end_of(beside(path))}


def _end_of(path: Path) -> End:
    recording = read_recording(path)
    return End(recording, replay(recording, board_of(recording.header)))


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
