"""`sweep`: many runs of one board, on this machine's cores or on a cluster, and their table."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from os import PathLike
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.judged import faults_of, output_faults
from firmware_runtime.lab.sweeps.local_pool import cores, run_here
from firmware_runtime.lab.sweeps.partial import Partial, partial_of
from firmware_runtime.lab.sweeps.plan import Sampling, Sweep
from firmware_runtime.lab.sweeps.row import Row, release
from firmware_runtime.lab.sweeps.sweep_table import Table, write_table

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
    _demand_texts(vary)
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
    path = None if output is None else Path(output)
    return carry_out(
        words, path, workers=workers, scheduler=scheduler, resume=resume, progress=progress
    )


def _demand_texts(vary: Mapping[str, object]) -> None:
    faults = [
        f"--vary {key}: {given!r}; expected a text, such as 'uniform(2, 4)'"
        for key, given in vary.items()
        if not isinstance(given, str)
    ]
    if faults:
        raise ConfigError("sweep", faults)


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
    faults = faults_of(sweep) + output_faults(output)
    faults += _option_faults(workers, scheduler)
    if resume and output is None:
        faults.append("--resume: there is no file to go on with; expected -o FILE")
    if faults:
        raise ConfigError("sweep", faults)
    with ExitStack() as stack:
        partial = None
        if output is not None:
            kept = Partial(partial_of(output), sweep, release(), resume=resume)
            partial = stack.enter_context(kept)
        rows = dict(partial.rows) if partial is not None else {}
        missing = [row for row in range(sweep.size) if row not in rows]
        shown = _Shown(progress, rows, sweep.size)
        for row in stack.enter_context(closing(_run(sweep, missing, workers, scheduler))):
            rows[row["row"]] = row  # type: ignore[index]
            if partial is not None:
                partial.keep(row)
            shown.add(row)
        table = Table([rows[number] for number in range(sweep.size)])
        if output is not None and partial is not None:
            write_table(table, output)
            partial.remove()
    return table


def _option_faults(workers: int | None, scheduler: str | None) -> Iterator[str]:
    """What is wrong with where it is to run."""
    if workers is not None and workers < 1:
        yield f"--workers: {workers}; expected 1 or more"
    if workers is not None and scheduler is not None:
        yield "--workers and --scheduler: a cluster has workers of its own; expected one"


def _run(
    sweep: Sweep, rows: Sequence[int], workers: int | None, scheduler: str | None
) -> Generator[Row, None, None]:
    if not rows:
        return
    if scheduler is None:
        yield from run_here(sweep, rows, workers or cores())
        return
    from firmware_runtime.lab.sweeps.cluster import run_on_cluster  # noqa: PLC0415 -- an extra's

    yield from run_on_cluster(sweep, rows, scheduler)


class _Shown:
    """Counts rows as they come, and reports progress."""

    def __init__(self, progress: Progress | None, rows: Mapping[int, Row], size: int) -> None:
        self._progress = progress
        self._size = size
        self._done = len(rows)
        self._failed = sum(each["outcome"] not in SOUND for each in rows.values())

    def add(self, row: Row) -> None:
        """Count one more."""
        self._done += 1
        self._failed += row["outcome"] not in SOUND
        if self._progress is not None:
            self._progress(self._done, self._size, self._failed)
