"""Everything wrong with a sweep, found before any run of it."""

import os
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from typing import Final

from msgspec.structs import replace

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.distributions import distribution
from firmware_runtime.lab.sweeps.plan import SAMPLINGS, Sweep
from firmware_runtime.lab.sweeps.row import settings_of_row, step_of
from firmware_runtime.lab.sweeps.sweep_table import ENDINGS
from firmware_runtime.system.packages import module_of_extra

MOST_RUNS: Final = 10_000_000
_TRIED: Final = 8
"""Rows whose settings are read beforehand: a fault that all have is one of the sweep."""


def faults_of(sweep: Sweep) -> list[str]:
    """Sentences, one each; settings that only some rows have are for these rows to say."""
    faults = [*_distribution_faults(sweep), *_number_faults(sweep)]
    if not faults:
        faults += _size_faults(sweep)
    return [*faults, *_board_faults(_sound_part(sweep) if faults else sweep)]


def output_faults(output: Path | None) -> list[str]:
    """What is wrong with the file that the table is to be written to."""
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
            module_of_extra("pyarrow", "sweep")
        except ConfigError as error:
            faults += [f"-o: {output.suffix} needs pyarrow: {each}" for each in error.faults]
    return faults


def _distribution_faults(sweep: Sweep) -> Iterator[str]:
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


def _sound_part(sweep: Sweep) -> Sweep:
    """The sweep without what has faults of its own, so that those of its keys are found too."""
    sound = {key: words for key, words in sweep.vary.items() if _is_distribution(words)}
    return replace(sweep, vary=sound, runs=1, sampling="random")


def _is_distribution(words: str) -> bool:
    try:
        distribution(words)
    except ValueError:
        return False
    return True


def _board_faults(sweep: Sweep) -> list[str]:
    """What the board says of the settings of the first rows, if all of them have faults."""
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
