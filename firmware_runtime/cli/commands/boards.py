"""`firmware-runtime boards`: which boards are installed."""

import argparse
import sys

from firmware_runtime.board import kinds, registry
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import settings_in_force
from firmware_runtime.cli.readers_gone import tell
from firmware_runtime.errors import ConfigError
from firmware_runtime.status import Status


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    add_verb(verbs, "boards", "List the boards that are installed.", execute)


def execute(_arguments: argparse.Namespace) -> int:
    """Print each board's name, description and file; those that are broken come last."""
    broken: list[ConfigError] = []
    for name in kinds.names():
        try:
            _print(registry.load(name))
        except ConfigError as error:
            broken.append(error)
        if copy := settings_in_force(name):
            print(f"{'':12} in force on this machine: {copy}")
    for each in broken:
        tell(f"firmware-runtime: {each}", sys.stderr)
    return Status.BAD_INPUT if broken else Status.OK


def _print(board: registry.Board) -> None:
    print(f"{board.name:12} {board.settings.description}\n{'':12} {board.source}")
