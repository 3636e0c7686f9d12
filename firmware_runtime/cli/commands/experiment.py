"""`firmware-runtime experiment NAME BOARD -o FOLDER`: an experiment in every stage, with a page."""

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_runtime.board.kinds import names
from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb, positive
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.readers_gone import print_line
from firmware_runtime.errors import ConfigError
from firmware_runtime.experiments import loop_experiment
from firmware_runtime.experiments.loop_experiment import run_loop
from firmware_runtime.experiments.results import Results, write_results
from firmware_runtime.experiments.running import Setup
from firmware_runtime.experiments.step_experiment import run_step
from firmware_runtime.links.cut.impairment import impairment
from firmware_runtime.spelling import did_you_mean
from firmware_runtime.stages.stage import Stage
from firmware_runtime.stages.way import WIFI
from firmware_runtime.status import Status

LOOP = "loop-delay"
_LOOP_S = 20.0
_SUMMARY = "Repeat an experiment with a board: data, a plot and a page, beside what was published."


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "experiment", _SUMMARY, execute)
    verb.add_argument("name", metavar="NAME", nargs="?", help="such as loop-delay; see --list")
    add_board(verb, required=False)
    verb.add_argument("--list", action="store_true", help="name the experiments there are")
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
    verb.add_argument(
        "--peer",
        metavar="HOST:PORT",
        help=f"{LOOP} in stage remote: where `run BOARD --role robot --loop` listens",
    )
    verb.add_argument("--key", type=Path, metavar="FILE", help="with --peer: both ends' key")
    verb.add_argument(
        "--for",
        type=positive,
        metavar="SECONDS",
        dest="duration_s",
        help=f"how long {LOOP} runs in each stage; default {_LOOP_S:g}",
    )
    verb.add_argument(
        "--every",
        type=positive,
        metavar="SECONDS",
        dest="every_s",
        help=f"{LOOP}: from one value of the ramp to the next; default 0.002, in stage remote 0.01",
    )
    verb.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="where its files are written"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the experiment; write its files, print its figures."""
    if arguments.list:
        return _list(arguments.board or arguments.name)
    board = _chosen(arguments)
    results = _loop(arguments, board) if arguments.name == LOOP else _step(arguments, board)
    for line in results.text:
        print(line)
    for path in write_results(results, arguments.output):
        print(path)
    return Status.OK


def _chosen(arguments: argparse.Namespace) -> Board:
    """The board, if all that is needed was given and fits. Raises ConfigError."""
    missing = [word for word in ("name", "board", "output") if getattr(arguments, word) is None]
    if missing:
        expected = "expected NAME, BOARD and -o FOLDER, or --list"
        raise ConfigError("experiment", [f"no {' and no '.join(missing)}; {expected}"])
    board = chosen_board(arguments.board, arguments.assignments)
    faults = list(_faults(arguments, board))
    if faults:
        raise ConfigError("experiment", faults)
    return board


def _faults(arguments: argparse.Namespace, board: Board) -> Iterator[str]:
    known = [LOOP, *board.experiments]
    if arguments.name not in known:
        expected = f"expected one of {', '.join(known)}{did_you_mean(arguments.name, known)}"
        yield f"{arguments.name}: {board.name} has no such experiment; {expected}"
    if arguments.name == LOOP and arguments.stage not in {None, Stage.NETWORK, Stage.REMOTE}:
        yield f"{LOOP}: stage {arguments.stage} has no link; expected network or remote"
    is_cut = arguments.stage is not None and Stage(arguments.stage).has_two_ends
    needs_link = arguments.name == LOOP or is_cut
    if needs_link and not board.settings.roles:
        yield f"{board.name} has no table [roles] in its board.toml; expected one, for two ends"
    if arguments.peer is not None and (arguments.name, arguments.stage) != (LOOP, Stage.REMOTE):
        yield f"--peer belongs to {LOOP} --stage remote: a step is watched where its world is"
    if (arguments.peer is None) != (arguments.key is None):
        yield "--peer and --key belong together; expected both or neither"
    if arguments.every_s is not None and arguments.name != LOOP:
        yield f"--every belongs to {LOOP}"
    if arguments.duration_s is not None and arguments.name != LOOP:
        yield f"--for: the board says how long {arguments.name} takes; leave it out"
    if arguments.output.exists() and not arguments.output.is_dir():
        yield f"-o: {arguments.output} is no folder; expected one, or a new name"
    elif not _takes_files(arguments.output):
        yield f"-o: {arguments.output} cannot be written; expected a folder that can"


def _takes_files(folder: Path) -> bool:
    """Whether a folder can be written, or made where the nearest one above it is."""
    nearest = next(
        each for each in (folder.absolute(), *folder.absolute().parents) if each.exists()
    )
    return nearest.is_dir() and os.access(nearest, os.W_OK)


def _loop(arguments: argparse.Namespace, board: Board) -> Results:
    stages = _stages(arguments, (Stage.NETWORK, Stage.REMOTE))
    for_s = _LOOP_S if arguments.duration_s is None else arguments.duration_s
    runs = run_loop(_setup(arguments, board, for_s), stages, _say)
    plots = dict(runs.plots())
    return Results(
        name=LOOP,
        title=loop_experiment.TITLE,
        board=board.name,
        published=loop_experiment.PUBLISHED,
        plots={f"{LOOP}-{stage}": plot for stage, plot in plots.items()},
        csv=list(runs.csv()),
        numbers=runs.numbers(),
        figures=runs.figures,
        text=list(runs.text()),
    )


def _step(arguments: argparse.Namespace, board: Board) -> Results:
    experiment = board.experiments[arguments.name]
    two = tuple(Stage) if board.settings.roles else (Stage.SIMULATION, Stage.EMBEDDED)
    board = chosen_board(arguments.board, [*arguments.assignments, *experiment.assignments])
    setup = _setup(
        arguments,
        board,
        experiment.for_s,
        inputs=[f"{experiment.at_s:g}:{experiment.port}={experiment.end!r}"],
    )
    chosen = dict.fromkeys((Stage.SIMULATION, *_stages(arguments, two)))  # to compare with
    runs = run_step(experiment, setup, list(chosen), _say)
    return Results(
        name=arguments.name,
        title=experiment.title,
        board=board.name,
        published=experiment.published,
        plots={arguments.name: runs.plot()},
        csv=list(runs.csv()),
        numbers=runs.numbers(),
        figures=runs.figures,
        text=list(runs.text()),
    )


def _setup(
    arguments: argparse.Namespace,
    board: Board,
    for_s: float,
    *,
    inputs: Sequence[str] = (),
) -> Setup:
    return Setup(
        board=board,
        named=arguments.board,
        for_s=for_s,
        how=WIFI if arguments.impair is None else impairment(arguments.impair),
        peer=arguments.peer,
        key=arguments.key,
        is_over_ros=arguments.link == "ros2",
        inputs=inputs,
        loop_s=arguments.every_s,
    )


def _stages(arguments: argparse.Namespace, fitting: Sequence[Stage]) -> Sequence[Stage]:
    return fitting if arguments.stage is None else (Stage(arguments.stage),)


def _list(board: str | None) -> int:
    """Name the experiments, of one board or of all."""
    for name in names() if board is None else [board]:
        found = chosen_board(name)
        for experiment, each in found.experiments.items():
            print(f"{experiment} {found.name}: {each.title}")
        if found.settings.roles:
            print(f"{LOOP} {found.name}: {loop_experiment.TITLE}")
    return Status.OK


def _say(sentence: str) -> None:
    print_line(sentence, sys.stderr)
