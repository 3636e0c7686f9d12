"""One run of the space: what it is, how it is run, and its row.

A row says all that it takes to run it again, and a fingerprint of what the robot did, to the bit.
"""

import gc
import json
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.fork import HANG, in_child
from firmware_runtime.lab.campaign.healthy import AT_START, Healthy, healthy
from firmware_runtime.lab.campaign.judge import SOUND, Judge, Oracle, Verdict, where_raised
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.space import Case, space_of
from firmware_runtime.lab.campaign.watched import Watched
from firmware_runtime.lab.sweeps.row import Cell, Row, release
from firmware_runtime.runs.open_board import OpenBoard

LOST: Final = "lost"


class Trial(Struct, frozen=True):
    """A mission and the faults that are made in it."""

    mission: Mission
    strike: Strike

    def row(self, number: int, verdict: Verdict) -> Row:
        """Return the row of a verdict."""
        mission, strike = self.mission, self.strike
        return {
            "row": number,
            "board": mission.board,
            "seed": mission.seed,
            "set": json.dumps(list(mission.assignments)),
            "mission_s": mission.for_s,
            "within_s": mission.within_s,
            "kind": strike.kind,
            "device": strike.device,
            "at_s": strike.at_s,
            "for_s": strike.for_s,
            "amount": strike.amount,
            "outcome": verdict.outcome,
            "what": verdict.what,
            "model": verdict.model,
            "known_at_s": verdict.at / SECOND,
            "said": verdict.said,
            "said_after_s": _in_s(verdict.said_after),
            "struck": verdict.struck,
            "ended": verdict.ended,
            "digest": verdict.digest,
            "version": release(),
        }


def trial_of(row: Row) -> Trial:
    """Return the trial of a row. Raises KeyError, TypeError and ValueError for another's row."""
    mission = Mission(
        board=str(row["board"]),
        assignments=tuple(json.loads(str(row["set"]))),
        for_s=_number(row["mission_s"]) or 0.0,
        seed=_whole(row["seed"]),
        within_s=_number(row["within_s"]),
    )
    strike = Strike(
        str(row["kind"]),
        str(row["device"] or ""),
        _number(row["at_s"]) or 0.0,
        _number(row["for_s"]),
        _number(row["amount"]),
    )
    return Trial(mission, strike)


def alone(
    trial: Trial, number: int = 0, oracle: Oracle | None = None, record: Path | None = None
) -> Row:
    """Run a trial from its start, in a child of its own; with `record` its recording is kept."""

    def work() -> Row:
        found = healthy(trial.mission)
        return trial.row(number, _from_the_start(trial, found, oracle, record))

    healthy(trial.mission)  # the child has it, and the next one, too
    return _answer(trial, number, in_child(work))


def forked(
    mission: Mission,
    numbers: Sequence[int],
    oracle: Oracle | None = None,
    until: float | None = None,
) -> Generator[Row, None, None]:
    """Run trials of the space, in order of time, each in a child that begins where it strikes.

    With `until`, an instant of the machine's clock, those that have not begun by then are left.
    """
    space, found = space_of(mission), healthy(mission)
    cases = sorted(((space[number], number) for number in numbers), key=lambda each: each[0].before)
    with _healthy_again(mission, found) as watched:
        for case, number in cases:
            if until is not None and time.monotonic() >= until:
                return
            trial = Trial(mission, case.strike)
            if case.before == AT_START or watched is None:
                yield alone(trial, number, oracle)
                continue
            while watched.at < case.before:
                watched.go_on()
            yield _answer(
                trial, number, in_child(_from_here(trial, number, watched, found, oracle))
            )


@contextmanager
def _healthy_again(mission: Mission, found: Healthy) -> Iterator[Watched | None]:
    robot = mission.opened()
    try:
        robot.session.hardware.struck  # noqa: B018 -- made once, here
        watched = Watched(robot, found.not_finite)
        gc.freeze()  # what there is now is no garbage of a child, which would copy it to look
        yield watched
    finally:
        gc.unfreeze()
        with suppress(FirmwareRuntimeError):  # it is a healthy one, which no verdict is about
            robot.close()


def _from_here(
    trial: Trial, number: int, watched: Watched, found: Healthy, oracle: Oracle | None
) -> Callable[[], Row]:
    def work() -> Row:
        watched.robot.session.hardware.strike([trial.strike])
        judge = Judge(watched, found, trial.strike, oracle)
        return trial.row(number, _judged(trial, judge))

    return work


def _from_the_start(
    trial: Trial, found: Healthy, oracle: Oracle | None, record: Path | None
) -> Verdict:
    """Judge a run that has its fault from before its first transaction."""
    try:
        robot: OpenBoard = trial.mission.opened([trial.strike], record=record)
    except HalError as error:
        return Verdict(outcome=SOUND, ended=f"not begun: {text_of(error)}", struck=True)
    except Exception as error:  # noqa: BLE001 -- of a driver or a model: the finding
        return _crash(trial, error)
    try:
        watched = Watched(robot, found.not_finite)
        return _judged(trial, Judge(watched, found, trial.strike, oracle))
    finally:
        with suppress(FirmwareRuntimeError):  # the verdict is there
            robot.close()


def _judged(trial: Trial, judge: Judge) -> Verdict:
    try:
        return judge.judge()
    except Exception as error:  # noqa: BLE001 -- raised past the executive: the finding
        return _crash(trial, error)


def _crash(trial: Trial, error: Exception) -> Verdict:
    what = f"{type(error).__name__}: {text_of(error)}"
    return Verdict(outcome="crash", what=what, model=where_raised(error), at=trial.strike.at)


def _answer(trial: Trial, number: int, answer: Row | str) -> Row:
    if not isinstance(answer, str):
        return answer
    outcome = "hang" if answer == HANG else "crash"
    verdict = Verdict(outcome=outcome, what=answer, model=trial.strike.device, at=trial.strike.at)
    return trial.row(number, verdict)


def lost(mission: Mission, number: int, case: Case, why: str) -> Row:
    """Return the row of a run whose process ended each time it was tried."""
    return Trial(mission, case.strike).row(number, Verdict(outcome=LOST, what=why))


def with_strike(trial: Trial, **changes: float | None) -> Trial:
    """Return a trial with another strike."""
    return replace(trial, strike=replace(trial.strike, **changes))


def _in_s(span: int | None) -> float | None:
    return None if span is None else span / SECOND


def _number(cell: Cell) -> float | None:
    return float(cell) if isinstance(cell, int | float) else None


def _whole(cell: Cell) -> int | None:
    return int(cell) if isinstance(cell, int | float) else None
