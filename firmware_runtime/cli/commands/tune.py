"""`firmware-runtime tune BOARD --from RUN | --plant [PLANT]`: gains for a board.toml."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.board_file import output_fault, write_copy
from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import SubParsers, add_board, add_output, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.commands.identify import add_since, identified_from
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.tuning.tuning_text import tuned_document, tuned_lines
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import exit_on_signals

if TYPE_CHECKING:
    from firmware_runtime.lab.tuning.task import Task

_ABOUT = """
The gains of least cost for the plant, with a gain margin of 6 dB and a phase margin of 45 degrees
or more; the cost is the integral of time and absolute error over a step, with a penalty for effort.
They are checked on runs that were not searched on: other steps, other noise, a push, and plants
from within the intervals. No file that a robot is run by is written over: look at the copy first.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Find gains for a board's loop from a recorded run, and check them on unseen ones."
    verb = add_verb(verbs, "tune", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    plant = verb.add_mutually_exclusive_group(required=True)
    plant.add_argument("--from", metavar="RUN", dest="run", help="identify the plant from this run")
    plant.add_argument(
        "--plant",
        metavar="PLANT",
        nargs="?",
        const="",
        help="FILE.json of `identify -o`, or KEY=VALUE,..., as in inertia_kg_m2=0.075,delay_s=0.05;"
        " by itself: as the board's settings state it",
    )
    add_since(verb)
    add_output(verb, "write a copy of the board.toml with the new gains, and nothing else changed")
    verb.add_argument("--json", action="store_true", help="print what was found as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Tune; print what was found, write the copy."""
    board = chosen_board(arguments.board, arguments.assignments)
    task_module = module_of_extra("firmware_runtime.lab.tuning.task", "tuning")
    _, loop = task_module.loop_of(board)
    output: Path | None = arguments.output
    if output is not None and (fault := output_fault(output, board)) is not None:
        raise ConfigError("-o", [fault])
    with exit_on_signals():
        task, doubts = _task(arguments, board)
        tuned = module_of_extra("firmware_runtime.lab.tuning.search", "tuning").tune(task)
    if not tuned.shipped_margins.is_stable:
        doubts = [*doubts, "the shipped gains make a loop with this plant that is not stable"]
    keys = task_module.keys_of(loop)
    if output is not None:
        values = {key: getattr(tuned.gains, name) for name, key in keys.items()}
        write_copy(board, values, output)
    if arguments.json:
        found = {**tuned_document(board, keys, task, tuned), "warnings": doubts}
        print(json.dumps(found, allow_nan=False))
    else:
        warnings = (f"warning: {each}" for each in doubts)
        print("\n".join((*tuned_lines(keys, task, tuned), *warnings)))
    return Status.OK


def _task(arguments: argparse.Namespace, board: Board) -> "tuple[Task, list[str]]":
    """What is sought, and what speaks against the plant that it is sought for."""
    doubts: list[str] = []
    module = module_of_extra("firmware_runtime.lab.tuning.task", "tuning")
    if arguments.run is not None:
        _, identified, _ = identified_from(arguments.run, board, arguments.since)
        plant, intervals = module.of_identified(identified)
        noise, doubts = identified.noise, identified.warnings
    elif not arguments.plant:
        plant, intervals, noise = module.plant_of_settings(board)
    else:
        declared, _ = module.loop_of(board)
        stated = module.stated_plant(arguments.plant, declared.structure, board.name)
        plant, intervals, noise, doubts = stated
    task: Task = module.task_of(board, plant, intervals, noise)
    return task, doubts
