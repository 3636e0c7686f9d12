"""`campaign`: strike a robot with each fault at each moment, on all cores, and say what breaks it.

    found = campaign("tachobot", budget_s=60.0)
    print(found)
    found.check()  # an AssertionError with three lines for each finding

Which runs are done first, and how one is kept from being done twice, is in stretches.py.
"""

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Final, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.campaign.again import number_of, trial_of_row
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.courses import in_courses
from firmware_runtime.lab.campaign.findings import (
    Finding,
    Shortening,
    as_in_rows,
    finding_without_faults,
    findings_of,
    is_same,
    is_wrong,
    make_folder,
)
from firmware_runtime.lab.campaign.going_on import going_on
from firmware_runtime.lab.campaign.healthy import healthy
from firmware_runtime.lab.campaign.kept_findings import (
    KeptFinding,
    folder_faults,
    keep_findings,
)
from firmware_runtime.lab.campaign.mission import Mission, span_faults
from firmware_runtime.lab.campaign.report import Report, never_shown, never_taken
from firmware_runtime.lab.campaign.space import space_of
from firmware_runtime.lab.campaign.stretches import Stretches, in_parts
from firmware_runtime.lab.campaign.trial import alone, trial_of
from firmware_runtime.lab.campaign.verdict import OF_TRUTH
from firmware_runtime.lab.sweeps.how import carried_out, how_faults
from firmware_runtime.lab.sweeps.partial import Partial, partial_of
from firmware_runtime.lab.sweeps.row import Row, release
from firmware_runtime.lab.sweeps.sweep_table import Table, write_table

Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with how many runs are done, how many there are, and how many of them found something."""

AGAIN: Final = 12
"""Runs that are run again to see that they are the same, beside those with findings."""


class Campaign(Struct, frozen=True, kw_only=True):
    """A campaign in words; where and for how long it is carried out is none of it."""

    mission: Mission

    def command(self) -> Iterator[str]:
        """Yield the words of its command."""
        yield "campaign"
        yield from self.mission.words


def campaign(  # noqa: PLR0913 -- the options of the command, by the same names
    board: str | PathLike[str],
    *,
    for_s: float = 10.0,
    set: Mapping[str, object] | None = None,  # noqa: A002 -- as the command has it
    seed: int | None = None,
    within_s: float | None = None,
    without: Sequence[str] = (),
    pairs: int = 0,
    runs: int | None = None,
    budget_s: float | None = None,
    output: str | PathLike[str] | None = None,
    findings: str | PathLike[str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    judge: Oracle | None = None,
    progress: Progress | None = None,
) -> Report:
    """Strike a board's mission of `for_s` with single faults, on doubles in virtual time.

    All of the space, or so many `runs`, or as many as fit into `budget_s`; either is spread evenly.
    Faults that you know and accept are left out by `without`, `KIND` or `KIND:DEVICE`. Beside
    single faults, `pairs` of them are tried, which strike within a second.
    The table of runs is written to `output`, findings to a folder as recordings and tests. By
    default all cores are used, by processes of their own: a script that calls this needs
    `if __name__ == "__main__":`. `judge` is an oracle of your own: given the rig, it returns a
    sentence about what is wrong with its world, or None; a run with it stays in this process.
    Raises ConfigError, naming every fault, before any run.
    """
    mission = Mission(
        board=str(board),
        assignments=tuple(assignments_of(set or {})),
        for_s=for_s,
        seed=seed,
        within_s=within_s,
        without=(without,) if isinstance(without, str) else tuple(without),
        pairs=pairs,
    )
    return carry_out(
        mission,
        None if output is None else Path(output),
        runs=runs,
        budget_s=budget_s,
        findings=None if findings is None else Path(findings),
        workers=workers,
        scheduler=scheduler,
        resume=resume,
        oracle=judge,
        progress=progress,
    )


def carry_out(  # noqa: PLR0913 -- where, how much, and what is shown of it
    mission: Mission,
    output: Path | None = None,
    *,
    runs: int | None = None,
    budget_s: float | None = None,
    findings: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    oracle: Oracle | None = None,
    progress: Progress | None = None,
    shortening: Shortening | None = None,
) -> Report:
    """Carry a campaign out; see `campaign`. The table is there before findings are made shorter."""
    faults = [
        *_faults_of(mission, runs, budget_s, oracle),
        *how_faults(output, workers, scheduler, resume=resume),
        *(() if findings is None else folder_faults(findings)),
    ]
    if faults:
        raise ConfigError("campaign", faults)
    if findings is not None:
        make_folder(findings)
    until = None if budget_s is None else time.monotonic() + budget_s
    space = space_of(mission)
    if (by_itself := finding_without_faults(mission, findings, oracle)) is not None:
        kept_there = _kept_in(findings, mission.board, [by_itself], oracle)
        return _summed_up(mission, (), [by_itself], kept_there)
    chosen = list(in_courses(space, runs))
    with ExitStack() as stack:
        partial = None
        if output is not None:
            plan = Campaign(mission=mission)
            kept = Partial(partial_of(output), plan, release(), resume=resume)
            partial = stack.enter_context(kept)
        rows = {} if partial is None else dict(partial.rows)
        parts = in_parts(chosen, rows)
        job = Stretches(
            found=healthy(mission),
            parts=parts,
            going_on=going_on(space, chosen),
            until=until,
            oracle=oracle,
        )
        found = sum(map(is_wrong, rows.values()))
        for row in stack.enter_context(closing(_rows_of(job, workers, scheduler))):
            rows[number_of(row)] = row
            if partial is not None:
                partial.keep(row)
            found += is_wrong(row)
            if progress is not None:
                progress(len(rows), len(chosen), found)
        in_order = [rows[number] for number in sorted(rows)]
        if output is not None and in_order:
            write_table(Table(in_order), output)
        report = _report(mission, in_order, findings, oracle, shortening)
        if partial is not None and in_order and len(rows) >= len(chosen):
            partial.remove()
    return report


def _rows_of(
    job: Stretches, workers: int | None, scheduler: str | None
) -> Generator[Row, None, None]:
    """Yield rows as parts of a job end; on a cluster, whose clocks are others, until the budget."""
    is_here, until = scheduler is None, job.until
    parts = carried_out(
        job if is_here else replace(job, until=None),
        range(len(job.parts)),
        1 if job.oracle is not None else workers,
        scheduler,
    )
    with closing(parts):
        for row in chain.from_iterable(parts):
            yield row
            if not is_here and until is not None and time.monotonic() >= until:
                return


def _report(
    mission: Mission,
    rows: Sequence[Row],
    folder: Path | None,
    oracle: Oracle | None,
    shortening: Shortening | None,
) -> Report:
    found = findings_of(rows, folder, oracle, shortening)
    step = max(1, len(rows) // AGAIN)
    again = [row for row in rows[::step] if not is_wrong(row)][:AGAIN]
    others = [row for row in again if not is_same(row, alone(trial_of(row), oracle=oracle))]
    flakes = len(others) + sum(each.is_flaky for each in found)
    kept = _kept_in(folder, mission.board, found, oracle)
    return _summed_up(mission, rows, found, kept, flakes=flakes, run_again=len(again) + len(found))


def _kept_in(
    folder: Path | None, board: str, found: Sequence[Finding], oracle: Oracle | None
) -> Sequence[KeptFinding]:
    return () if folder is None else keep_findings(folder, board, found, oracle)


def report_of(rows: Sequence[Row], kept: Sequence[KeptFinding] = ()) -> Report:
    """Return the report of a table, without any run but healthy ones, which say what there is.

    Findings are those that are kept of its board and not fixed; without any, as they are in rows.
    Raises ConfigError for no rows of a campaign.
    """
    for row in rows:
        trial_of_row(row)
    mission = trial_of_row(rows[0]).mission
    of_board = [each for each in kept if each.finding.mission.board == mission.board]
    left = [each.finding for each in of_board if not each.fixed]
    return _summed_up(mission, rows, left if of_board else as_in_rows(rows), of_board)


def _summed_up(  # noqa: PLR0913 -- what a report has beside what follows from its rows
    mission: Mission,
    rows: Sequence[Row],
    findings: Sequence[Finding],
    kept: Sequence[KeptFinding],
    *,
    flakes: int = 0,
    run_again: int = 0,
) -> Report:
    """Return a report, with what there is in the mission's space, and what rows have not shown."""
    space, found = space_of(mission), healthy(mission)
    return Report(
        board=mission.board,
        space=len(space),
        rows=rows,
        findings=findings,
        flakes=flakes,
        run_again=run_again,
        never=never_shown(space, rows),
        left_out=(*mission.without, *found.stated.unknowable),
        not_judged=() if found.envelope.names else OF_TRUTH,
        answers=found.answers,
        limits=found.stated.limits,
        arrows=len(found.arrows),
        never_taken=never_taken(found, rows),
        kept=kept,
    )


def _faults_of(
    mission: Mission, runs: object, budget_s: float | None, oracle: object
) -> Iterator[str]:
    """Yield what is wrong with the choices, one sentence each."""
    yield from span_faults("--budget", budget_s)
    if runs is not None and not (isinstance(runs, int) and runs >= 1):
        yield f"--runs: {runs!r}; expected 1 or more"
    if oracle is not None and not callable(oracle):
        yield f"judge: {oracle!r}; expected a function of a rig"
    yield from mission.faults()
