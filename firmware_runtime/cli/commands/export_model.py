"""`firmware-runtime export MODEL -o FILE.ma`: a coupled model in E-CD++'s format."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_model import ABOUT, chosen_model
from firmware_runtime.cli.written import write_text
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.class_catalogue import known_classes
from firmware_runtime.ecdpp.model_writer import model_text
from firmware_runtime.errors import ConfigError
from firmware_runtime.status import Status

_ABOUT = """
Reading the file gives the same model: same components, ports, couplings and parameters. What the
format cannot say is refused, and nothing is written.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Write a coupled model as a model file of E-CD++."
    verb = add_verb(verbs, "export", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb, about=ABOUT, metavar="MODEL")
    verb.add_argument("-o", "--output", type=Path, metavar="FILE.ma", help="default: the screen")


def execute(arguments: argparse.Namespace) -> int:
    """Write the file, once it was found to give the same model."""
    output: Path | None = arguments.output
    if output is not None and output.suffix != ".ma":
        raise ConfigError.of_one("-o", f"{output}: expected a name that ends in .ma")
    model = chosen_model(arguments.board, arguments.assignments)
    if not isinstance(model, Coupled):
        fault = "an atomic model; expected a coupled one"
        raise ConfigError.of_one(arguments.board, fault)
    write_text(model_text(model, known_classes()), output)
    return Status.OK
