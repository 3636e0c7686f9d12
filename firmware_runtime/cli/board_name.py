"""The name of a board that is installed on a system: a kind's, or a robot's own."""

import argparse

from firmware_runtime.board import kinds
from firmware_runtime.board.in_force import SETTINGS
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.installation.places import boards_with_settings
from firmware_runtime.host.installation.target import Target
from firmware_runtime.host.installation.uninstall import installed_boards
from firmware_runtime.spelling import did_you_mean


def add_board_name(verb: argparse.ArgumentParser, otherwise: str | None = None) -> None:
    """Add BOARD; it may be left out if there is something that is meant otherwise."""
    about = "a board's name, or a robot's own"
    verb.add_argument(
        "board",
        metavar="BOARD",
        nargs=None if otherwise is None else "?",
        help=about if otherwise is None else f"{about}; default: {otherwise}",
    )


def demand_known(name: str, target: Target) -> None:
    """Raise ConfigError for a name that is neither a kind's nor installed or kept in a system."""
    kept = boards_with_settings(target.tree.names(SETTINGS))
    known = list(dict.fromkeys([*kinds.names(), *kept, *installed_boards(target)]))
    if name not in known:
        expected = f"expected one of {', '.join(known)}{did_you_mean(name, known)}"
        raise ConfigError(name, [f"unknown board; {expected}"])
