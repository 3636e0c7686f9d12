"""`firmware-runtime boards`: which boards are installed."""

import argparse
import sys

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.local_settings import known_names, settings_in_force
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.readers_gone import print_line
from firmware_runtime.errors import ConfigError, Status


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    add_verb(verbs, "boards", "List the boards that are installed.", execute)


def execute(_arguments: argparse.Namespace) -> int:
    """Print each board's name, description and file; those that are broken come last."""
    broken: list[ConfigError] = []
    for name in known_names():
        try:
            _print(name)
        except ConfigError as error:
            broken.append(error)
    for each in broken:
        print_line(f"firmware-runtime: {each}", sys.stderr)
    return Status.BAD_INPUT if broken else Status.OK


def _print(name: str) -> None:
    """A kind as it is shipped, or a robot's own settings."""
    copy = settings_in_force(name)
    if copy is not None and name not in kinds.names():
        board = registry.load_copy(copy, name)
        print(f"{name:12} {board.settings.description}\n{'':12} a {board.kind}, by {copy}")
        return
    board = registry.load(name)
    print(f"{name:12} {board.settings.description}\n{'':12} {board.source}")
    if copy is not None:
        print(f"{'':12} in force on this machine: {copy}")
