"""One run of the space: what it is, how it is run, and its row.

A row says all that it takes to run it again, and a fingerprint of what the robot did, to the bit.
"""

import gc
import json
import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Final, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.hal.strike import Strike, interval_of
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.fork import HANGS, in_child
from firmware_runtime.lab.campaign.healthy import AT_START, Healthy, healthy
from firmware_runtime.lab.campaign.judge import Judge
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.space import Case, Space
from firmware_runtime.lab.campaign.verdict import SOUND, Verdict, where_raised
from firmware_runtime.lab.campaign.watched import EVERY, Watched
from firmware_runtime.lab.sweeps.row import Cell, Row, release
from firmware_runtime.runs.open_board import OpenBoard

LOST: Final = "lost"


class Trial(Struct, frozen=True):
    """A mission and the faults that are made in it."""

    mission: Mission
    strikes: tuple[Strike, ...]
    """One, two of a pair, or one that comes again and again, in order of time."""
    goes_on: bool = False
    """Whether its run goes on to the end of the mission, which has to be fulfilled."""

    @property
    def kinds(self) -> str:
        """Return the kinds of its faults, as `nack`, `nack + push` or `nack again and again`."""
        if interval_of(self.strikes) is not None:
            return f"{self.strikes[0].kind} again and again"
        return " + ".join(each.kind for each in self.strikes)

    def row(self, number: int, verdict: Verdict) -> Row:
        """Return the row of a verdict."""
        mission, strike = self.mission, self.strikes[0]
        return {
            "row": number,
            "board": mission.board,
            "seed": mission.seed,
            "set": json.dumps(list(mission.assignments)),
            "mission_s": mission.for_s,
            "within_s": mission.within_s,
            "without": json.dumps(list(mission.without)),
            "kind": strike.kind,
            "device": strike.device,
            "at_s": strike.at_s,
            "for_s": strike.for_s,
            "amount": strike.amount,
            "others": json.dumps([_cells(each) for each in self.strikes[1:]]),
            "goes_on": self.goes_on,
            "outcome": verdict.outcome,
            "what": verdict.what,
            "model": verdict.model,
            "known_at_s": verdict.at / SECOND,
            "said": verdict.said,
            "said_after_s": _in_s(verdict.said_after),
            "struck": verdict.struck,
            "ended": verdict.ended,
            "reached": json.dumps(verdict.reached),
            "digest": verdict.digest,
            "version": release(),
        }


def trial_of(row: Row) -> Trial:
    """Return the trial of a row.

    Raises KeyError, TypeError, ValueError and OverflowError for another's row.
    """
    mission = Mission(
        board=str(row["board"]),
        assignments=tuple(json.loads(str(row["set"]))),
        for_s=_number(row["mission_s"]) or 0.0,
        seed=_whole(row["seed"]),
        within_s=_number(row["within_s"]),
        without=tuple(json.loads(str(row["without"]))),
    )
    if said := list(mission.span_faults()):
        raise ValueError("; ".join(said))
    first = (row["kind"], row["device"], row["at_s"], row["for_s"], row["amount"])
    others = json.loads(str(row["others"]))
    strikes = tuple(_strike(*cells) for cells in (first, *others))
    return Trial(mission, strikes, goes_on=bool(row.get("goes_on")))


def _cells(strike: Strike) -> tuple[Cell, ...]:
    return strike.kind, strike.device, strike.at_s, strike.for_s, strike.amount


def _strike(kind: Cell, device: Cell, at_s: Cell, for_s: Cell, amount: Cell) -> Strike:
    strike = Strike(
        str(kind), str(device or ""), _number(at_s) or 0.0, _number(for_s), _number(amount)
    )
    if (fault := strike.fault()) is not None:
        raise ValueError(fault)
    return strike


def alone(
    trial: Trial,
    number: int = 0,
    oracle: Oracle | None = None,
    record: Path | None = None,
    found: Healthy | None = None,
) -> Row:
    """Run a trial from its start, in a child of its own; with `record` its recording is kept."""
    known = healthy(trial.mission) if found is None else found

    def work() -> Row:
        return trial.row(number, _from_the_start(trial, known, oracle, record))

    return _answered(trial, number, in_child(work))


def forked(  # noqa: PLR0913 -- which, judged by what, and how long
    found: Healthy,
    numbers: Sequence[int],
    oracle: Oracle | None = None,
    until: float | None = None,
    *,
    is_first: bool = False,
    going_on: Collection[int] = (),
) -> Generator[Row, None, None]:
    """Run trials of the space, in order of time, each in a child that begins where it strikes.

    A fault that lasts for a while and the same one for ever are one run until the first ends. With
    `until`, an instant of the machine's clock, those that have not begun by then are left; of the
    first trials of a campaign one is run all the same: without any, nothing has been judged. Those
    `going_on` do so to the end of their mission.
    """
    if _is_over(until) and not is_first:
        return
    mission, space = found.mission, Space(found)
    cases = sorted(((space[number], number) for number in numbers), key=_order)
    with _healthy_again(found, oracle) as watched:
        for place, (_, alike) in enumerate(groupby(cases, _course)):
            if _is_over(until) and not (is_first and place == 0):
                return
            course = [
                (Trial(mission, case.strikes, goes_on=number in going_on), number)
                for case, number in alike
            ]
            before = space[course[0][1]].before
            if before == AT_START:
                yield from (alone(trial, number, oracle, found=found) for trial, number in course)
                continue
            while watched.at < before:
                watched.go_on()
            together = partial(_together, course, watched, found)
            rows = in_child(together) if len(course) == 2 else []
            done = [] if isinstance(rows, str) else rows
            yield from done
            for trial, number in course:
                if number not in [row["row"] for row in done]:
                    work = partial(_from_here, trial, number, watched, found)
                    yield _answered(trial, number, in_child(work))


def _is_over(until: float | None) -> bool:
    return until is not None and time.monotonic() >= until


def _order(each: tuple[Case, int]) -> tuple[int, int]:
    """Order cases by where they begin."""
    return each[0].before, each[1]


def _course(each: tuple[Case, int]) -> tuple[object, ...]:
    """Return what is equal for cases that are one run until the first of them ends."""
    case, number = each
    first, *others = case.strikes
    is_one = bool(others) or first.span <= 2 * EVERY
    return number if is_one else -1, case.before, replace(first, for_s=None)


def _together(course: Sequence[tuple[Trial, int]], watched: Watched, found: Healthy) -> list[Row]:
    """Run a fault for a while and the same one for ever, which are one run up to the first end.

    Where a transaction has come after that already, the row of the longer one alone is returned.
    """
    (shorter, number), (longer, its_number) = course
    strike, hardware = shorter.strikes[0], watched.robot.session.hardware
    end = strike.at + strike.span
    hardware.strike(longer.strikes)
    judge = Judge(watched, found, longer.strikes, goes_on=longer.goes_on)
    verdict = _verdict(longer, lambda: judge.judge_until(end - EVERY))
    if verdict is not None and hardware.world_now() > end:  # it ended while it was switched off
        return [longer.row(its_number, verdict)]
    if verdict is not None:  # or it is over: so are both
        return [trial.row(each, verdict) for trial, each in course]

    def go_on() -> Row:
        hardware.struck.end(end)
        its_judge = judge.of_shorter(shorter.strikes, goes_on=shorter.goes_on)
        return shorter.row(number, _verdict(shorter, its_judge.judge))

    def stay() -> Row:
        rest = judge.closed if judge.is_sure else judge.judge
        return longer.row(its_number, _verdict(longer, rest))

    if hardware.world_now() > end:
        return [stay()]
    if judge.is_sure:  # what is left of it is short
        last = in_child(stay)
        return [go_on(), _answered(longer, its_number, last)]
    row = _answered(shorter, number, in_child(go_on))
    return [row, stay()]


@contextmanager
def _healthy_again(found: Healthy, oracle: Oracle | None) -> Iterator[Watched]:
    robot = found.mission.opened()
    try:
        robot.session.hardware.struck  # noqa: B018 -- made once, here
        watched = Watched(robot, found.not_finite, oracle)
        gc.freeze()  # what there is now is no garbage of a child, which would copy it to look
        yield watched
    finally:
        gc.unfreeze()
        with suppress(FirmwareRuntimeError):  # it is a healthy one, which no verdict is about
            robot.close()


def _from_here(trial: Trial, number: int, watched: Watched, found: Healthy) -> Row:
    watched.robot.session.hardware.strike(trial.strikes)
    judge = Judge(watched, found, trial.strikes, goes_on=trial.goes_on)
    return trial.row(number, _verdict(trial, judge.judge))


def _from_the_start(
    trial: Trial, found: Healthy, oracle: Oracle | None, record: Path | None
) -> Verdict:
    """Judge a run that has its fault from before its first transaction."""
    try:
        robot: OpenBoard = trial.mission.opened(trial.strikes, record=record)
    except HalError as error:
        return Verdict(outcome=SOUND, ended=f"not begun: {text_of(error)}", struck=True)
    except Exception as error:  # noqa: BLE001 -- of a driver or a model: the finding
        return _crash(trial, error)
    try:
        watched = Watched(robot, found.not_finite, oracle)
        judge = Judge(watched, found, trial.strikes, goes_on=trial.goes_on)
        return _verdict(trial, judge.judge)
    finally:
        with suppress(FirmwareRuntimeError):  # the verdict is there
            robot.close()


V = TypeVar("V", Verdict, Verdict | None)


def _verdict(trial: Trial, judge: Callable[[], V]) -> V | Verdict:
    try:
        return judge()
    except Exception as error:  # noqa: BLE001 -- raised past the executive: the finding
        return _crash(trial, error)


def _crash(trial: Trial, error: Exception) -> Verdict:
    what = f"{type(error).__name__}: {text_of(error)}"
    return Verdict(outcome="crash", what=what, model=where_raised(error), at=trial.strikes[0].at)


def _answered(trial: Trial, number: int, answer: Row | str) -> Row:
    if not isinstance(answer, str):
        return answer
    outcome = "hang" if answer in HANGS else "crash"
    first = trial.strikes[0]
    verdict = Verdict(outcome=outcome, what=answer, model=first.device, at=first.at)
    return trial.row(number, verdict)


def lost(mission: Mission, number: int, case: Case, why: str) -> Row:
    """Return the row of a run whose process ended each time it was tried."""
    return Trial(mission, case.strikes).row(number, Verdict(outcome=LOST, what=why))


def _in_s(span: int | None) -> float | None:
    return None if span is None else span / SECOND


def _number(cell: Cell) -> float | None:
    return float(cell) if isinstance(cell, int | float) else None


def _whole(cell: Cell) -> int | None:
    return int(cell) if isinstance(cell, int | float) else None
