"""What a run is doing, in short: for the top of the page, and for programs as `GET /api/state`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.errors import FirmwareRuntimeError, StatisticsFileError
from firmware_runtime.links.control import ask
from firmware_runtime.live.observed import Observed
from firmware_runtime.models.motion import Applied
from firmware_runtime.statistics.closing_text import VIRTUAL, punctuality
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

_TIMEOUT_S: Final = 0.2
OFF: Final = Applied.NOTHING.name
IN_THE_RUN: Final = "in the run"
"""In the place of a socket: doubles in the run's own process."""


class FaultLine(Struct, frozen=True):
    """Faults of one kind that a model reported."""

    model: str
    kind: str
    count: int
    first_s: float | None
    last_s: float | None
    sentence: str


class RunState(Struct, frozen=True):
    """State of a run; what is not known is None."""

    board: str
    state: str
    """running, ended, stopped, failed, overrun, died; `recording` where there is but that."""
    reason: str | None
    armed: bool | None
    why_not_armed: str | None
    at_s: float
    sentence: str
    """What the robot is doing, in a line."""
    faults: list[FaultLine]
    outputs: dict[str, str]
    """What each actuator says that it applies: NOTHING, PART or ALL of its command, by model."""
    punctual: str | None
    """How punctual it is, in words."""
    doubles: str | None
    """Where its doubles are served, or `in the run`; None on chips."""
    pid: int | None
    note: str | None


def statistics_at(path: Path | None) -> Statistics | None:
    """The statistics that a run keeps there; None where there are none to read."""
    try:
        return None if path is None else read_statistics(path)
    except StatisticsFileError:
        return None


def run_state(observed: Observed, statistics: Statistics | None, path: Path | None) -> RunState:
    """The state of a run, by what is seen of it and by its statistics."""
    if statistics is None:
        return _of_recording(observed)
    figures = statistics.figures()
    run = figures.conditions.run
    is_running = run.state == "running"
    armed = run.armed if is_running else None
    why = _why_not_armed(path) if is_running and not armed else None
    return RunState(
        board=observed.board.name,
        state=run.state,
        reason=run.reason,
        armed=armed,
        why_not_armed=why,
        at_s=observed.at / 1e9,
        sentence=_sentence(observed, figures, armed=armed, why=why),
        faults=_faults(figures),
        outputs=_outputs(observed),
        punctual=punctuality(figures),
        doubles=_doubles(figures.conditions.stated),
        pid=statistics.header.writer.pid if is_running else None,
        note=observed.remark,
    )


def _of_recording(observed: Observed) -> RunState:
    """The state of a run of which there is but the recording, as it was run again."""
    at_s, again = observed.at / 1e9, observed.statistics
    figures = None if again is None else again.figures()
    punctual = None if figures is None else punctuality(figures)
    return RunState(
        board=observed.board.name,
        state="recording",
        reason=observed.end,
        armed=None,
        why_not_armed=None,
        at_s=at_s,
        sentence=f"a recording of {at_s:.1f} s; {observed.end or 'its end is not in it'}",
        faults=[] if figures is None else _faults(figures),
        outputs=_outputs(observed),
        punctual=VIRTUAL if observed.header.speed == 0 else punctual,
        doubles=None,
        pid=None,
        note=observed.remark,
    )


def _sentence(observed: Observed, figures: Figures, *, armed: bool | None, why: str | None) -> str:
    run = figures.conditions.run
    if run.state == "running":
        if armed:
            return f"{observed.board.name} is armed and runs since {run.elapsed_s:.0f} s"
        return f"{observed.board.name} is disarmed: {why or 'why, the run has not said yet'}"
    because = f": {run.reason}" if run.reason else ""
    return f"{observed.board.name}: {run.state} after {run.elapsed_s:.1f} s{because}"


def _why_not_armed(path: Path | None) -> str | None:
    if path is None:
        return None
    try:
        reason = ask(path, "state", timeout_s=_TIMEOUT_S).get("reason")
    except FirmwareRuntimeError:
        return None
    return reason if isinstance(reason, str) else None


def _faults(figures: Figures) -> list[FaultLine]:
    """All kinds of faults, the one that came last first."""
    found = [
        FaultLine(path, kind, each.count, each.first_s, each.last_s, each.last)
        for path, kinds in figures.faults.items()
        for kind, each in kinds.items()
    ]
    return sorted(found, key=lambda each: -(each.last_s or 0.0))


def _outputs(observed: Observed) -> dict[str, str]:
    """Those of the hardware models, which stand at the top of a robot."""
    actuators = (
        path
        for path, port in observed.ports.items()
        if port.type is Applied and path.count(".") == 1
    )
    return {
        path.partition(".")[0]: OFF
        if observed.is_off
        else str(observed.values.get(path, "unknown"))
        for path in actuators
    }


def _doubles(stated: Mapping[str, object]) -> str | None:
    doubles = stated.get("doubles")
    if isinstance(doubles, str):
        return doubles
    return IN_THE_RUN if doubles else None
