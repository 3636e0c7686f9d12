"""`firmware-runtime identify BOARD --from RUN`: a body's numbers out of a recording of a run."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import SubParsers, add_board, add_output, add_verb, since
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.written import check_output
from firmware_runtime.errors import Status
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import exit_on_signals
from firmware_runtime.view.page import page_of

if TYPE_CHECKING:
    from firmware_runtime.lab.identification.fit import Fit
    from firmware_runtime.lab.identification.identified import Identified
    from firmware_runtime.lab.identification.recorded_series import Series

_ABOUT = """
RUN is a recording, as `replay` takes it: a file, or a board for its last run; or a file of
`run --trace`; or a CSV table with the columns time_s, input (N, or N m) and
output. What the board's input and output are, its definition says. The run should push the body
both ways, quickly and slowly, and let it come to rest.
"""
_SUFFIXES = (".json", ".html")


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Identify mass or inertia, friction and delay from a recorded run, with intervals."
    verb = add_verb(verbs, "identify", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    verb.add_argument(
        "--from",
        required=True,
        metavar="RUN",
        dest="run",
        help="what to identify from: a file, or a board for its last run",
    )
    add_since(verb)
    add_output(verb, "write FILE.json for `tune --plant` and programs, or FILE.html for people")
    verb.add_argument("--json", action="store_true", help="print the numbers as JSON")


def add_since(verb: argparse.ArgumentParser) -> None:
    """Add --since, of a run that is identified from."""
    verb.add_argument(
        "--since",
        type=since,
        metavar="SECONDS",
        help="leave out what was measured before this second, as while motors start",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Identify, and print or write what came of it."""
    if arguments.output is not None:
        check_output(arguments.output, _SUFFIXES)
    board = chosen_board(arguments.board, arguments.assignments)
    with exit_on_signals():
        series, identified, fit = identified_from(arguments.run, board, arguments.since)
    if arguments.output is not None:
        _write(arguments.output, board, series, identified, fit)
    if arguments.json:
        print(json.dumps(_as_json(board, identified), allow_nan=False))
    else:
        words = module_of_extra("firmware_runtime.lab.identification.identification_page", "tuning")
        print("\n".join(words.lines(identified)))
    return Status.OK


def identified_from(
    run: str, board: Board, since_s: float | None
) -> "tuple[Series, Identified, Fit]":
    """What a run shows of a board's plant. Raises ConfigError, also without scipy."""
    source = module_of_extra("firmware_runtime.lab.identification.source", "tuning")
    plant = source.plant_of(board)
    series = source.read_series(run, board, since_s)
    found = module_of_extra("firmware_runtime.lab.identification.identified", "tuning")
    identified, fit = found.identify(series, plant.structure, plant.lag_s(board.settings))
    return series, identified, fit


def _as_json(board: Board, identified: "Identified") -> dict[str, object]:
    found = module_of_extra("firmware_runtime.lab.identification.identified", "tuning")
    title = "" if board.plant is None else board.plant.title
    return {"board": board.name, "plant": title, **found.as_json(identified)}


def _write(
    output: Path, board: Board, series: "Series", identified: "Identified", fit: "Fit"
) -> None:
    if output.suffix == ".html":
        words = module_of_extra("firmware_runtime.lab.identification.identification_page", "tuning")
        title = "" if board.plant is None else board.plant.title
        text = page_of(words.page(board.name, title, identified, series, fit))
    else:
        text = json.dumps(_as_json(board, identified), indent=1, allow_nan=False) + "\n"
    keep_output(output, text.encode())
