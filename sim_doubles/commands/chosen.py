"""The doubles that the command line names: a board's, or single chips without a board."""

import argparse
from collections.abc import Sequence
from typing import Final, NamedTuple

from firmware_runtime.cli.arguments import add_board
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.line_time import WireClock
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from sim_doubles.rigs.chips import ChipsRig, placed

CHIPS: Final = "chips"
"""Name of chips without a board, where a board has its own."""


class Chosen(NamedTuple):
    """Doubles to be served, and what they are called."""

    name: str
    rig: DoublesRig


def add_choice(verb: argparse.ArgumentParser) -> None:
    """Add BOARD, --set and --chip."""
    add_board(verb, required=False)
    verb.add_argument(
        "--chip",
        action="append",
        default=[],
        metavar="NAME[@0xNN]",
        dest="chips",
        help="a single chip instead of a board, at its usual address or another; may be repeated",
    )


def chosen(arguments: argparse.Namespace, clock: WireClock) -> Chosen:
    """Make what the command line names. Raises ConfigError with every fault."""
    words: Sequence[str] = arguments.chips
    if (arguments.board is None) == (not words):
        named = "neither" if arguments.board is None else "both"
        raise ConfigError("doubles", [f"BOARD or --chip: {named} given; expected one of the two"])
    if words:
        if arguments.assignments:
            raise ConfigError("doubles", ["--set: with --chip there is no board; expected BOARD"])
        return Chosen(CHIPS, ChipsRig(placed(words), clock))
    board = chosen_board(arguments.board, arguments.assignments)
    return Chosen(board.name, rig_for(board, clock))
