"""The name of a board that comes with the project, as an argument."""

import argparse

from firmware_runtime.board import kinds


def add_board_name(verb: argparse.ArgumentParser, otherwise: str | None = None) -> None:
    """Add BOARD; it may be left out if there is something that is meant otherwise."""
    names = kinds.names()
    about = f"{' or '.join(names)}"
    verb.add_argument(
        "board",
        metavar="BOARD",
        nargs=None if otherwise is None else "?",
        choices=names,
        help=about if otherwise is None else f"{about}; default: {otherwise}",
    )
