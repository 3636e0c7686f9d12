"""`firmware-runtime diagram BOARD -o FILE`: a picture of the model, from its own declaration."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_output, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.chosen_model import ANY, chosen_model, is_model
from firmware_runtime.cli.written import check_output, write_text
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import Status
from firmware_runtime.view.diagram.draw import Form, diagram

FORMS: dict[str, Form] = {".svg": "svg", ".mmd": "mmd"}


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Draw a board's couplings, or one model's states, as SVG or Mermaid."
    verb = add_verb(verbs, "diagram", summary, execute)
    add_board(verb, about=ANY)
    add_output(verb, "FILE.svg or FILE.mmd", required=True)
    verb.add_argument(
        "--state", metavar="MODEL", help="draw this model's states, such as controller.mode"
    )
    verb.add_argument(
        "--whole", action="store_true", help="draw the robot with its hardware, not the model alone"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write the picture; no line is opened."""
    path: Path = arguments.output
    check_output(path, FORMS)
    model = _model(arguments)
    write_text(diagram(model, arguments.state, FORMS[path.suffix]), path)
    return Status.OK


def _model(arguments: argparse.Namespace) -> Component:
    """The model that event files run on, where there is one, else the robot."""
    if is_model(arguments.board):
        return chosen_model(arguments.board, arguments.assignments)
    board = chosen_board(arguments.board, arguments.assignments)
    if board.event_model is not None and not arguments.whole:
        return board.event_model(None)
    return board.unconnected().model
