"""Rows of a campaign run again: one from its start, many in stretches, and faults in a test."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from os import PathLike
from typing import Final

from msgspec.structs import replace

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.findings import is_same
from firmware_runtime.lab.campaign.healthy import healthy
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.space import space_of
from firmware_runtime.lab.campaign.stretches import Stretches, in_parts
from firmware_runtime.lab.campaign.trial import Trial, alone, trial_of
from firmware_runtime.lab.campaign.verdict import SOUND
from firmware_runtime.lab.campaign.without_faults import wrong_without_faults
from firmware_runtime.lab.sweeps.how import carried_out
from firmware_runtime.lab.sweeps.row import Row

_SAID: Final = frozenset(
    {"row", "outcome", "what", "model", "known_at_s", "said", "said_after_s", "struck", "ended"}
    | {"reached", "digest", "version"}
)
"""Columns of what became of a trial."""


def rerun(row: Row) -> Row:
    """Run a row again from its start, as it was. Raises ConfigError for no row of a campaign."""
    trial = trial_of_row(row)
    _check_faults(trial.mission, trial.strikes)
    return alone(trial, number_of(row))


def rerun_many(
    rows: Sequence[Row],
    runs: int,
    workers: int | None = None,
    progress: Callable[[int, int, int], None] | None = None,
) -> tuple[int, list[Row]]:
    """Run so many rows of a table again, spread evenly: how many were, and those that differ.

    They share healthy runs with others than before. Raises ConfigError for no rows of a campaign,
    and for those of a robot that has other faults at their numbers by now.
    """
    count = min(runs, len(rows))
    chosen = {
        number_of(each): each for each in (rows[k * len(rows) // count] for k in range(count))
    }
    mission = _mission_of(rows)
    if moved := _moved(mission, chosen):
        fault = f"{len(moved)} of {count} rows are other faults of {mission.board} by now"
        one = f", row {moved[0]} for one"
        raise ConfigError.of_one("campaign", f"{fault}{one}", "a table of the robot as it is")
    on = frozenset(number for number, row in chosen.items() if trial_of(row).goes_on)
    job = Stretches(found=healthy(mission), parts=in_parts(list(chosen)), going_on=on)
    others: list[Row] = []
    done = 0
    for again in chain.from_iterable(carried_out(job, range(len(job.parts)), workers, None)):
        done += 1
        if not is_same(chosen[number_of(again)], again):
            others.append(again)
        if progress is not None:
            progress(done, count, len(others))
    return done, others


def _moved(mission: Mission, chosen: Mapping[int, Row]) -> list[int]:
    """Return the numbers that stand for other faults in the space of the mission."""
    space = space_of(mission)
    return [
        number
        for number, row in chosen.items()
        if number >= len(space) or space[number].strikes != trial_of_row(row).strikes
    ]


def _mission_of(rows: Sequence[Row]) -> Mission:
    """Return the mission of a table, with as many pairs as it has."""
    mission = trial_of_row(rows[0]).mission
    last = max(map(number_of, rows))
    return replace(mission, pairs=max(0, last + 1 - space_of(mission).pairs_from))


def number_of(row: Row) -> int:
    """Return the number of a row in its space."""
    return int(row["row"] or 0)


def trial_of_row(row: Row) -> Trial:
    """Return the trial of a row. Raises ConfigError for no row of a campaign."""
    try:
        _check_outcome(row)
        return trial_of(row)
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        fault = f"row {row.get('row')} is none of a campaign: {error}"
        raise ConfigError.of_one("campaign", fault) from error


def _check_faults(mission: Mission, faults: Sequence[Strike]) -> None:
    """Raise ConfigError for faults that cannot be made on the doubles of its robot."""
    robot = mission.opened()
    try:
        robot.session.hardware.strike(faults)
    finally:
        with suppress(HalError):  # they have begun
            robot.close()


def _check_outcome(row: Row) -> None:
    """Raise ValueError or TypeError for a row that does not say what became of a trial."""
    missing = _SAID - row.keys()
    if missing:
        raise ValueError(f"it has no {', no '.join(sorted(missing))}")
    for name in ("row", "known_at_s", "said_after_s"):
        if not isinstance(row[name], int | float | None):
            raise TypeError(f"{name} is {row[name]!r}, expected a number")
    reached = json.loads(str(row["reached"]))
    if not (isinstance(reached, list) and all(isinstance(each, str) for each in reached)):
        raise TypeError(f"reached is {row['reached']!r}, expected a list of arrows")


def assert_sound(  # noqa: PLR0913 -- as `campaign`
    board: str | PathLike[str],
    faults: Sequence[Strike],
    *,
    for_s: float = 10.0,
    set: Mapping[str, object] | None = None,  # noqa: A002 -- as the command has it
    seed: int | None = None,
    within_s: float | None = None,
    goes_on: bool = False,
    judge: Oracle | None = None,
) -> None:
    """Fail the test of a robot that these faults break, or none; it is judged as in a campaign.

    With `goes_on` its run goes on to the end of the mission, which it has to fulfil.
    Raises ConfigError for a mission that there cannot be, and for faults that cannot be made on its
    doubles.
    """
    __tracebackhide__ = True
    mission = Mission(
        board=str(board),
        assignments=tuple(assignments_of(set or {})),
        for_s=for_s,
        seed=seed,
        within_s=within_s,
    )
    if said := list(mission.faults()):
        raise ConfigError("campaign", said)
    wrong = healthy(mission).wrong if faults else wrong_without_faults(mission, judge)
    if wrong is not None:
        raise AssertionError(f"{wrong.oracle} of {wrong.model}: {wrong.what}")
    if not faults:
        return
    _check_faults(mission, faults)
    row = alone(Trial(mission, tuple(faults), goes_on=goes_on), oracle=judge)
    if row["outcome"] != SOUND:
        raise AssertionError(f"{row['outcome']} of {row['model']}: {row['what']}")
