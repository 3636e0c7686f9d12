"""The experiments of a board: its own by name, and those that any board can have."""

import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from typing import Final

from firmware_runtime.board.experiments import Experiment, OwnExperiment
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import Stage
from firmware_runtime.system.packages import version_of

_NAME = re.compile(r"[\w.-]+")


def missing_packages(experiment: Experiment) -> str | None:
    """Name the packages that it lacks here and the command that installs them; None for none."""
    missing = [each for each in experiment.packages if not _is_installed(each)]
    if not missing:
        return None
    command = shlex.join([sys.executable, "-m", "pip", "install", *missing])
    return f"not installed: {', '.join(missing)}; expected {command}"


def _is_installed(package: str) -> bool:
    """Return whether any version of it is there."""
    found = _NAME.match(package)
    return version_of(package if found is None else found[0]) is not None


LOOP: Final = "loop-delay"
LOOP_DELAY: Final = OwnExperiment(
    title="Delay of a loop: a ramp out and back",
    stages=(Stage.NETWORK, Stage.REMOTE),
    run="firmware_runtime.lab.experiments.loop_experiment:run_loop",
)
"""Experiment of any board with a table [roles]; one with published figures has its own."""


def experiments_of(board: Board) -> Mapping[str, Experiment]:
    """All that can be tried with this board, in the order in which it names them."""
    found = dict(board.experiments)
    return {**found, LOOP: LOOP_DELAY, **found} if board.settings.roles else found


def stages_of(board: Board, experiment: Experiment) -> Sequence[Stage]:
    """The stages that an experiment can be run in with this board, in order.

    A stage of two ends takes a table [roles].
    """
    wanted = [stage for stage in Stage if not experiment.stages or stage in experiment.stages]
    return [stage for stage in wanted if board.settings.roles or not stage.has_two_ends]
