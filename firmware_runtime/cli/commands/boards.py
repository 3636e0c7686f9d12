"""`firmware-runtime boards`: which robots come with the project."""

import argparse

from firmware_runtime.board import registry
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import settings_in_force
from firmware_runtime.status import Status


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    add_verb(verbs, "boards", "List the boards that come with the project.", execute)


def execute(_arguments: argparse.Namespace) -> int:
    """Print each board's name, description and file."""
    for name in registry.names():
        board = registry.load(name)
        print(f"{board.name:12} {board.settings.description}\n{'':12} {board.source}")
        if copy := settings_in_force(name):
            print(f"{'':12} in force on this machine: {copy}")
    return Status.OK
