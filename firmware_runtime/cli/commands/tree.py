"""`firmware-runtime tree BOARD`: the model's hierarchy, for people."""

import argparse

from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.chosen_model import ANY, chosen_model, is_model
from firmware_runtime.devs.tree import tree
from firmware_runtime.errors import Status


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "tree", "Show a board's model: components, ports, couplings.", execute)
    add_board(verb, about=ANY)


def execute(arguments: argparse.Namespace) -> int:
    """Print the tree; no bus is opened."""
    if is_model(arguments.board):
        print(tree(chosen_model(arguments.board, arguments.assignments)))
        return Status.OK
    board = chosen_board(arguments.board, arguments.assignments)
    print(tree(board.unconnected().model))
    return Status.OK
