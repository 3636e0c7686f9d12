"""One stage of a board as a process of its own: recorded, then replayed and compared."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic_ns
from typing import Any, Final

from firmware_runtime.board.roles import CONTROLLER, ROBOT, Stage
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status
from firmware_runtime.lab.stages.staged_run import Staged, beside, run_to_end
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.difference import Difference
from firmware_runtime.recording.replay.verdict import Verdict, replay

_CANNOT: Final = (Status.BAD_INPUT, Status.NO_DEVICE, Status.REFUSED)
"""Exit statuses of a run that this machine or this board does not allow."""


@dataclass(frozen=True, slots=True)
class End:
    """Recording of one process of a stage, and the verdict of its replay."""

    recording: Recording
    verdict: Verdict

    @property
    def is_identical(self) -> bool | None:
        """Return whether the whole run is its replay; None where that could not all be compared."""
        if self.recording.is_from_start or self.verdict.is_identical is False:
            return self.verdict.is_identical
        return None

    @property
    def fault(self) -> str | None:
        """Return why it is not shown that the whole run is its replay; None if it is."""
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
    """Result of a stage; `why_not` says that it cannot be run here, and why.

    One that should have run and left nothing has `failed` and no ends.
    """

    stage: Stage
    why_not: str | None = None
    ends: Mapping[str, End] = field(default_factory=dict)
    """By role, or `whole` for a stage of one process."""
    document: Mapping[str, Any] = field(default_factory=dict)
    """Document that `run --json` printed."""
    failed: str | None = None
    """Fault of the run itself, if it had one, whatever its replay is."""

    @property
    def has_run(self) -> bool:
        """Return whether it was run."""
        return self.why_not is None

    @property
    def controller_began_s(self) -> float:
        """Start of the controller by the robot end's time, s, in a stage of two ends."""
        begins = self.document.get("statistics", {}).get("begins_ns", {})
        later: int = begins.get(CONTROLLER, 0) - begins.get(ROBOT, 0)
        return later / SECOND

    @property
    def is_identical(self) -> bool | None:
        """Return whether the run ended well, and each end is its replay; None as for an end."""
        if self.failed is not None or not self.ends:
            return False
        return all_of(end.is_identical for end in self.ends.values())

    @property
    def fault(self) -> str | None:
        """Return what keeps it from that, a sentence; None if nothing does."""
        if self.failed is not None:
            return self.failed
        ends = ((role, end.fault) for role, end in self.ends.items())
        said = [f"{role}: {fault}" for role, fault in ends if fault is not None]
        return "; ".join(said) or None

    def total(self, count: str) -> int:
        """Sum over all ends of a count of their verdicts, such as `values`."""
        return sum(getattr(end.verdict, count) for end in self.ends.values())

    @property
    def first_difference(self) -> Difference | None:
        """The first, of the first end that has one."""
        return next((each.verdict.first for each in self.ends.values() if each.verdict.first), None)


def all_of(found: Iterable[bool | None]) -> bool | None:
    """False if any is, else None if any is, else True."""
    every = list(found)
    return False if False in every else None if None in every else True


def run_stage(plan: Staged, stage: Stage, folder: Path) -> StageRun:
    """Run a stage to its end as planned for any, then replay it.

    It is recorded in the folder. A stage that this machine cannot run says why. Raises SystemExit
    for a signal.
    """
    path, said = folder / f"{stage}.recording", list[str]()
    staged = replace(plan, stage=stage, record=path, called_at=monotonic_ns())
    for each in (path, beside(path)):
        each.unlink(missing_ok=True)  # of another run, in a folder that is kept
    try:
        result = run_to_end(staged, said.append)
    except ConfigError as fault:
        return StageRun(stage, "; ".join(fault.faults))
    except FirmwareRuntimeError as fault:
        return StageRun(stage, failed=str(fault))
    try:
        ends = _ends(stage, path)
    except ConfigError as fault:
        why = said[-1].partition(": ")[2] if said else str(fault)
        if result.status in _CANNOT:
            return StageRun(stage, why)
        return StageRun(stage, document=result.document, failed=why)
    failed = None
    if result.status != Status.OK:
        failed = f"the run ended with status {result.status}: {result.reason}"
    return StageRun(stage, None, ends, result.document, failed)


def _ends(stage: Stage, path: Path) -> dict[str, End]:
    """Every process of the stage, replayed. Raises ConfigError for a recording that is missing."""
    if not stage.has_two_ends:
        return {"whole": _end_of(path)}
    return {CONTROLLER: _end_of(path), ROBOT: _end_of(beside(path))}


def _end_of(path: Path) -> End:
    recording = read_recording(path)
    return End(recording, replay(recording, board_of(recording.header)))
