"""How a table of many runs is made: into which file, by which processes, or on which cluster."""

import os
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.local_pool import Job, cores, run_here
from firmware_runtime.lab.sweeps.sweep_table import ENDINGS
from firmware_runtime.system.packages import module_of_extra

T = TypeVar("T")


def how_faults(
    output: Path | None, workers: int | None, scheduler: str | None, *, resume: bool
) -> Iterator[str]:
    """Yield what is wrong with these options, one sentence each."""
    yield from _output_faults(output)
    if workers is not None and workers < 1:
        yield f"--workers: {workers}; expected 1 or more"
    if workers is not None and scheduler is not None:
        yield "--workers and --scheduler: a cluster has workers of its own; expected one"
    if resume and output is None:
        yield "--resume: there is no file to go on with; expected -o FILE"


def carried_out(
    job: Job[T], numbers: Sequence[int], workers: int | None, scheduler: str | None
) -> Generator[T, None, None]:
    """Run parts of a job, here or on a cluster, and yield each as it ends, in any order."""
    if not numbers:
        return
    if scheduler is None:
        yield from run_here(job, numbers, workers or cores())
        return
    from firmware_runtime.lab.sweeps.cluster import run_on_cluster  # noqa: PLC0415 -- an extra's

    yield from run_on_cluster(job, numbers, scheduler)


def _output_faults(output: Path | None) -> list[str]:
    """Check the file that the table is to be written to."""
    if output is None:
        return []
    if output.suffix not in ENDINGS:
        return [f"-o: {output}; expected a name that ends in {' or '.join(ENDINGS)}"]
    faults = []
    if not (output.parent.is_dir() and os.access(output.parent, os.W_OK)):
        faults.append(f"-o: {output} cannot be written; expected a folder that can")
    elif output.exists() and not (output.is_file() and os.access(output, os.W_OK)):
        faults.append(f"-o: {output} is no file that can be written; expected one, or a new name")
    if output.suffix == ".parquet":
        try:
            module_of_extra("pyarrow", "parquet")
        except ConfigError as error:
            faults += [f"-o: {output.suffix} needs pyarrow: {each}" for each in error.faults]
    return faults
