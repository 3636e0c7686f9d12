"""`sweep`: many runs of one board, on this machine's cores or on a cluster, and their table."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import Final, TypeAlias

from msgspec.structs import replace

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.distributions import distribution
from firmware_runtime.lab.sweeps.how import carried_out, how_faults
from firmware_runtime.lab.sweeps.partial import Partial, partial_of
from firmware_runtime.lab.sweeps.plan import SAMPLINGS, Sampling, Sweep
from firmware_runtime.lab.sweeps.row import RowsOf, release, settings_of_row, step_of
from firmware_runtime.lab.sweeps.sweep_table import Table, write_table

MOST_RUNS: Final = 10_000_000
_TRIED: Final = 8
"""Rows whose settings are read beforehand: a fault that all have is one of the sweep."""


def faults_of(sweep: Sweep) -> list[str]:
    """Sentences, one each; settings that only some rows have are for these rows to say."""
    sound: dict[str, str] = {}
    faults = [*_distribution_faults(sweep, sound), *_number_faults(sweep)]
    if not faults:
        faults += _size_faults(sweep)
    if faults:  # those of the keys are found all the same
        sweep = replace(sweep, vary=sound, runs=1, sampling="random")
    return [*faults, *_board_faults(sweep)]


def _distribution_faults(sweep: Sweep, sound: dict[str, str]) -> Iterator[str]:
    """Check what is varied; `sound` gets the distributions that are some."""
    if not sweep.vary:
        yield "--vary: nothing is varied; expected KEY=DISTRIBUTION, such as world.seed=range(100)"
    fixed = {each.partition("=")[0].strip() for each in sweep.assignments}
    for key, words in sweep.vary.items():
        if key in fixed:
            yield f"--vary {key}: --set states it too; expected one of them"
        try:
            distribution(words)
        except ValueError as error:
            yield f"--vary {key}: {error}"
        else:
            sound[key] = words


def _number_faults(sweep: Sweep) -> Iterator[str]:
    runs: object = sweep.runs  # from Python it may be anything
    if runs is not None and not (isinstance(runs, int) and 1 <= runs <= MOST_RUNS):
        yield f"--runs: {runs!r}; expected a whole number, 1 to {MOST_RUNS}"
    if sweep.for_s is not None and not (isfinite(sweep.for_s) and sweep.for_s > 0):
        yield f"--for: {sweep.for_s}; expected a positive number of seconds"
    if sweep.sampling not in SAMPLINGS:
        yield f"--sampling: {sweep.sampling!r}; expected {' or '.join(SAMPLINGS)}"


def _size_faults(sweep: Sweep) -> Iterator[str]:
    if sweep.size == 0:
        yield "--runs: every key is drawn at random; expected how many runs"
    elif sweep.size > MOST_RUNS:
        yield f"--vary: {sweep.size} points of a grid; expected {MOST_RUNS} at most, or --runs"


def _board_faults(sweep: Sweep) -> list[str]:
    """Check the settings of the first rows against the board, for faults that all of them have."""
    try:
        board = board_in_force(sweep.board)
    except ConfigError as error:
        return [f"{error.where}: {each}" for each in error.faults]
    try:
        if not has_rig(board):
            return [f"{board.name} has no doubles; expected a board with a rig"]
        if sweep.experiment is not None:
            step_of(sweep.board, sweep.experiment)
    except ConfigError as error:
        return list(error.faults)
    found: list[list[str]] = []
    for row in range(min(sweep.size, _TRIED)):
        try:
            board_in_force(sweep.board, assignments_of(settings_of_row(sweep, row)))
        except ConfigError as error:
            found.append(list(error.faults))
        else:
            return []
    return found[0] if found else []


Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with how many rows are finished, how many there are, and how many of them failed."""

SOUND = frozenset({"ended", "stopped"})
"""Outcomes of runs that ended in order: at the end, or because the robot's task was over."""


def sweep(  # noqa: PLR0913 -- the options of the command, by the same names
    board: str | PathLike[str],
    vary: Mapping[str, str],
    *,
    runs: int | None = None,
    output: str | PathLike[str] | None = None,
    seed: int = 0,
    for_s: float | None = None,
    set: Mapping[str, object] | None = None,  # noqa: A002 -- as the command has it
    experiment: str | None = None,
    sampling: Sampling = "random",
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> Table:
    """Run the board once a row on its doubles in virtual time; return the table.

    `vary` are distributions by key, such as `{"world.mass_kg": "uniform(2, 4)"}`. With an `output`
    the table is written there, and finished rows are kept beside it until then: `resume` goes on
    from them. By default all cores are used, by processes of their own: a script that calls this
    needs `if __name__ == "__main__":`. Raises ConfigError, naming every fault, before any run.
    """
    words = Sweep(
        board=str(board),
        vary=dict(vary),
        assignments=assignments_of(set or {}),
        runs=runs,
        seed=seed,
        for_s=for_s,
        experiment=experiment,
        sampling=sampling,
    )
    return carry_out(
        words,
        None if output is None else Path(output),
        workers=workers,
        scheduler=scheduler,
        resume=resume,
        progress=progress,
    )


def carry_out(  # noqa: PLR0913 -- where, how, and what is shown of it
    sweep: Sweep,
    output: Path | None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> Table:
    """Carry a sweep out as it stands; see `sweep`."""
    faults = [*faults_of(sweep), *how_faults(output, workers, scheduler, resume=resume)]
    if faults:
        raise ConfigError("sweep", faults)
    with ExitStack() as stack:
        partial = None
        if output is not None:
            kept = Partial(partial_of(output), sweep, release(), resume=resume)
            partial = stack.enter_context(kept)
        rows = dict(partial.rows) if partial is not None else {}
        missing = [row for row in range(sweep.size) if row not in rows]
        failed = sum(each["outcome"] not in SOUND for each in rows.values())
        for row in stack.enter_context(
            closing(carried_out(RowsOf(sweep), missing, workers, scheduler))
        ):
            rows[row["row"]] = row  # type: ignore[index]
            if partial is not None:
                partial.keep(row)
            failed += row["outcome"] not in SOUND
            if progress is not None:
                progress(len(rows), sweep.size, failed)
        table = Table([rows[number] for number in range(sweep.size)])
        if output is not None and partial is not None:
            write_table(table, output)
            partial.remove()
    return table
