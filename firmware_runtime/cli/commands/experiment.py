"""`firmware-runtime experiment NAME BOARD -o FOLDER`: an experiment in every stage, with a page."""

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from firmware_runtime.board.experiments import ALL
from firmware_runtime.board.installed import names
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import Stage
from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_duration,
    add_output,
    add_verb,
    positive,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError, Status, expected_one_of
from firmware_runtime.lab.experiments.known import LOOP, experiments_of, missing_packages, stages_of
from firmware_runtime.lab.experiments.results import (
    run_series,
    sentences_of,
    series_lines,
    write_experiment,
    write_series,
)
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.lab.stages.staged_run import Staged, own_state
from firmware_runtime.lab.stages.way import WIFI
from firmware_runtime.links.cut.impaired_path import impairment
from firmware_runtime.system.own_folder import nearest, whole_folder
from firmware_runtime.system.signals import exit_on_signals
from firmware_runtime.system.terminal import print_line
from firmware_runtime.view.page_file import why_no_pictures

_SUMMARY = "Repeat an experiment with a board: data, a plot and a page, beside what was published."
_ABOUT = f"""
`{ALL}` runs every experiment of the board, one after the other, and adds index.html and
results.json; one that fails does not keep the next from being run, and one that lacks a package
is said first and not run. Exit status 0: done, 1: one of several failed or was not run. Files
appear when all is done: what was interrupted or failed leaves none.
"""
_LEAST_EVERY_S: Final = 1e-4
"""A ramp that is quicker keeps a processor busy, and measures that."""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "experiment", _SUMMARY, execute)
    verb.epilog = _ABOUT
    verb.add_argument(
        "experiment",
        metavar="NAME",
        nargs="?",
        help=f"such as {LOOP}, or {ALL}; without it those that there are are listed",
    )
    add_board(verb, required=False)
    add_output(verb, "where its files are written", metavar="FOLDER")
    _add_stage(verb)
    _add_loop(verb)


def _add_stage(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--stage",
        choices=[str(stage) for stage in Stage],
        metavar="STAGE",
        help="only this one of simulation, network, remote, embedded; default: all that fit",
    )
    verb.add_argument(
        "--link",
        choices=("udp", "ros2"),
        default="udp",
        help="what stage network goes over (default udp)",
    )
    verb.add_argument(
        "--impair",
        metavar="HOW",
        help=f"stage remote's network, each way; default {WIFI}".replace("%", "%%"),
    )


def _add_loop(verb: argparse.ArgumentParser) -> None:
    loop = verb.add_argument_group(LOOP)
    loop.add_argument(
        "--peer",
        metavar="HOST:PORT",
        help="in stage remote: where `run BOARD --role robot --loop` listens",
    )
    loop.add_argument("--key", type=Path, metavar="FILE", help="with --peer: both ends' key")
    add_duration(loop, "how long the ramp lasts in each stage; default 20")
    loop.add_argument(
        "--every",
        type=positive,
        metavar="SECONDS",
        dest="every_s",
        help="from one value of the ramp to the next; default 0.002, in stage remote 0.01",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run what was chosen; write its files, print its figures."""
    if arguments.experiment is None:
        return _list()
    board = _chosen(arguments)
    chosen = list(experiments_of(board)) if arguments.experiment == ALL else [arguments.experiment]
    with exit_on_signals(), own_state(), _whole(arguments.output) as folder:
        trials = list(_trials(arguments, board, chosen, folder))
        if why := why_no_pictures():
            _say(f"the pages hold the plots, and no plot is a file of its own: {why}")
        status, written = (_all if arguments.experiment == ALL else _one)(trials, folder)
    for name in written:
        print(arguments.output / name)
    return status


def _one(trials: Sequence[Trial], _folder: Path) -> tuple[int, list[str]]:
    [trial] = trials
    outcome, written = write_experiment(trial)
    for line in sentences_of(outcome):
        print(line)
    return Status.OK, written


def _all(trials: Sequence[Trial], folder: Path) -> tuple[int, list[str]]:
    if not trials:
        raise ConfigError.of_one("experiment", "none has this stage", expected="one that has")
    series = run_series(trials, _say)
    written = write_series(series, trials[0].board.name, folder)
    for line in series_lines(series):
        print(line)
    is_done = all(each.findings is not None for each in series)
    return Status.OK if is_done else Status.MODEL_ERROR, written


def _trials(
    arguments: argparse.Namespace, board: Board, wanted: Sequence[str], folder: Path
) -> Iterator[Trial]:
    """Each of these experiments that has a stage among those chosen."""
    known = experiments_of(board)
    for name in wanted:
        stages = [each for each in stages_of(board, known[name]) if _is_chosen(arguments, each)]
        if not stages:
            _say(f"{name}: left out, it has no stage {arguments.stage or 'here'}")
            continue
        assignments = [*known[name].assignments, *arguments.assignments]
        yield Trial(
            name=name,
            experiment=known[name],
            plan=_plan(arguments, chosen_board(arguments.board, assignments)),
            stages=stages,
            folder=folder,
            say=_say,
        )


def _is_chosen(arguments: argparse.Namespace, stage: Stage) -> bool:
    return arguments.stage is None or Stage(arguments.stage) is stage


def _plan(arguments: argparse.Namespace, board: Board) -> Staged:
    return Staged(
        board=board,
        named=arguments.board,
        how=WIFI if arguments.impair is None else impairment(arguments.impair),
        is_over_ros=arguments.link == "ros2",
        peer=arguments.peer,
        key=arguments.key,
        for_s=arguments.duration_s or 0.0,
        loop_s=arguments.every_s,
    )


# What was asked for ------------------------------------------------------------------------------


def _chosen(arguments: argparse.Namespace) -> Board:
    """The board, if all that is needed was given and fits. Raises ConfigError."""
    missing = [word for word in ("board", "output") if getattr(arguments, word) is None]
    if missing:
        expected = "expected NAME, BOARD and -o FOLDER, or none of them for a list"
        raise ConfigError("experiment", [f"no {' and no '.join(missing)}; {expected}"])
    board = chosen_board(arguments.board, arguments.assignments)
    _plan(arguments, board)  # what cannot be read is refused before anything runs
    faults = [*_name_faults(arguments, board), *_loop_faults(arguments), *_way_faults(arguments)]
    faults += _output_faults(arguments.output)
    if faults:
        raise ConfigError("experiment", faults)
    return board


def _name_faults(arguments: argparse.Namespace, board: Board) -> Iterator[str]:
    """What is wrong with the experiment or its stage."""
    known, name = experiments_of(board), arguments.experiment
    choices = [*known, ALL] if known else []
    if name == LOOP and not board.settings.roles:
        yield f"{board.name} has no table [roles] in its board.toml; expected one, for two ends"
    elif name not in choices:
        yield f"{name}: {board.name} has no such experiment; {expected_one_of(name, choices)}"
    elif name != ALL and arguments.stage is not None:
        stages = stages_of(board, known[name])
        if Stage(arguments.stage) not in stages:
            yield f"{name}: no stage {arguments.stage} here; expected {', '.join(stages)}"
    if name in known and (missing := missing_packages(known[name])):
        yield f"{name}: {missing}"


def _loop_faults(arguments: argparse.Namespace) -> Iterator[str]:
    """What is wrong with options that only the loop has."""
    if arguments.peer is not None and (arguments.experiment, arguments.stage) != (
        LOOP,
        Stage.REMOTE,
    ):
        yield f"--peer belongs to {LOOP} --stage remote: a step is watched where its world is"
    if (arguments.peer is None) != (arguments.key is None):
        yield "--peer and --key belong together; expected both or neither"
    if arguments.every_s is not None and arguments.experiment not in {LOOP, ALL}:
        yield f"--every belongs to {LOOP}"
    if arguments.every_s is not None and arguments.every_s < _LEAST_EVERY_S:
        yield f"--every: {arguments.every_s:g} s; expected {_LEAST_EVERY_S:g} or more"
    if arguments.duration_s is not None and arguments.experiment not in {LOOP, ALL}:
        yield f"--for: the board says how long {arguments.experiment} takes; leave it out"


def _way_faults(arguments: argparse.Namespace) -> Iterator[str]:
    """What is between the ends in another stage than the only one that is run."""
    if arguments.link == "ros2" and arguments.stage not in {None, Stage.NETWORK}:
        yield f"--link ros2 belongs to --stage {Stage.NETWORK}"
    if arguments.impair is not None and arguments.stage not in {None, Stage.REMOTE}:
        yield f"--impair belongs to --stage {Stage.REMOTE}"
    if arguments.impair is not None and arguments.peer is not None:
        yield "--impair is for a stand-in on this machine: leave it out where there is a --peer"


def _output_faults(output: Path) -> Iterator[str]:
    if output.exists() and not output.is_dir():
        yield f"-o: {output} is no folder; expected one, or a new name"
    elif not (nearest(output).is_dir() and os.access(nearest(output), os.W_OK)):
        yield f"-o: {output} cannot be written; expected a folder that can"


def _list() -> int:
    """Name the experiments of every board."""
    for name in names():
        found = chosen_board(name)
        for experiment, each in experiments_of(found).items():
            figure = f" ({each.figure})" if each.figure else ""
            print(f"{experiment} {found.name}: {each.title}{figure}")
    return Status.OK


# While it runs -----------------------------------------------------------------------------------


@contextmanager
def _whole(output: Path) -> Iterator[Path]:
    """Where files are gathered that appear in the output at the end. Raises ConfigError."""
    try:
        with whole_folder(output) as folder:
            yield folder
    except OSError as error:
        fault = f"-o: {output}: {error.strerror}; expected a folder that can be written"
        raise ConfigError("experiment", [fault]) from error


def _say(sentence: str) -> None:
    print_line(sentence, sys.stderr)
