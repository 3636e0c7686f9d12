"""`firmware-runtime tune BOARD --from RUN | --plant [PLANT]`: gains for a board.toml."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import SubParsers, add_board, add_output, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.commands.identify import add_since, identified_from
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.statistics.run_text import aligned
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import exit_on_signals

if TYPE_CHECKING:
    from firmware_runtime.lab.tuning.loop import Gains, Margins
    from firmware_runtime.lab.tuning.search import Tuned
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
    file = module_of_extra("firmware_runtime.lab.tuning.board_file", "tuning")
    _, loop = task_module.loop_of(board)
    output: Path | None = arguments.output
    if output is not None and (fault := file.output_fault(output, board)) is not None:
        raise ConfigError("-o", [fault])
    with exit_on_signals():
        task, doubts = _task(arguments, board)
        tuned = module_of_extra("firmware_runtime.lab.tuning.search", "tuning").tune(task)
    if not tuned.shipped_margins.is_stable:
        doubts = [*doubts, "the shipped gains make a loop with this plant that is not stable"]
    keys = task_module.keys_of(loop)
    if output is not None:
        values = {key: getattr(tuned.gains, name) for name, key in keys.items()}
        file.write_copy(board, values, output)
    if arguments.json:
        found = {**_as_json(board, keys, task, tuned), "warnings": doubts}
        print(json.dumps(found, allow_nan=False))
    else:
        warnings = (f"warning: {each}" for each in doubts)
        print("\n".join((*_lines(keys, task, tuned), *warnings)))
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


def _as_json(board: Board, keys: dict[str, str], task: "Task", tuned: "Tuned") -> dict[str, Any]:
    plant = module_of_extra("firmware_runtime.lab.identification.plant", "tuning")
    structure = "rotation" if board.plant is None else board.plant.structure
    shipped, found = tuned.seen
    return {
        "board": board.name,
        "plant": dict(zip(plant.KEYS[structure], task.body.plant.values, strict=True)),
        "gains": {key: getattr(tuned.gains, name) for name, key in keys.items()},
        "shipped": {key: getattr(task.shipped, name) for name, key in keys.items()},
        "margins": _margins_json(tuned.margins),
        "shipped_margins": _margins_json(tuned.shipped_margins),
        "cost": {"shipped": shipped, "tuned": found},
        "unseen": {
            "runs": len(tuned.unseen),
            "better": tuned.better,
            "cost": {"shipped": _mean(tuned, 0), "tuned": _mean(tuned, 1)},
        },
    }


def _margins_json(found: "Margins") -> dict[str, float | None]:
    values = {"gain_db": found.gain_db, "phase_deg": found.phase_deg, "delay_s": found.delay_s}
    return {key: value if abs(value) < float("inf") else None for key, value in values.items()}


def _mean(tuned: "Tuned", place: int) -> float:
    return sum(each[place] for each in tuned.unseen) / len(tuned.unseen)


def _lines(keys: dict[str, str], task: "Task", tuned: "Tuned") -> Iterator[str]:
    """Both sets of gains beside each other, and how they fare."""
    rows: list[tuple[str, ...]] = [("", "shipped", "tuned")]
    rows += [(key, *_both(task.shipped, tuned.gains, name)) for name, key in keys.items()]
    before, after = tuned.shipped_margins, tuned.margins
    rows.append(("gain margin, dB", f"{before.gain_db:.1f}", f"{after.gain_db:.1f}"))
    rows.append(("phase margin, deg", f"{before.phase_deg:.0f}", f"{after.phase_deg:.0f}"))
    rows.append(("cost, s2", *(f"{each:.3g}" for each in tuned.seen)))
    rows.append(("cost of unseen runs, s2", f"{_mean(tuned, 0):.3g}", f"{_mean(tuned, 1):.3g}"))
    yield from aligned(rows)
    yield f"better in {tuned.better} of {len(tuned.unseen)} runs that were not searched on"


def _both(shipped: "Gains", tuned: "Gains", name: str) -> tuple[str, str]:
    return f"{getattr(shipped, name):.4g}", f"{getattr(tuned, name):.4g}"
