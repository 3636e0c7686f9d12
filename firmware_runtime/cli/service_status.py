"""`firmware-runtime service status [BOARD]`: how systemd and the statistics say a board does.

BOARD is one that is installed on a system, by the name of its kind or by the robot's own.
"""

import argparse
import json
import sys
from collections.abc import Sequence

from firmware_runtime.board import installed as kinds
from firmware_runtime.board.local_settings import SETTINGS
from firmware_runtime.cli.arguments import Execute, SubParsers, add_verb
from firmware_runtime.errors import (
    ConfigError,
    InstallationRefused,
    Status,
    StepFailed,
    expected_one_of,
)
from firmware_runtime.host.installation.plan import boards_with_settings, instance
from firmware_runtime.host.installation.service_text import (
    SERVICES,
    service_document,
    service_lines,
)
from firmware_runtime.host.installation.target import (
    Target,
    require_systemd,
    state_of,
    target,
)
from firmware_runtime.host.installation.uninstall import installed_boards


def add_status_to(actions: SubParsers) -> None:
    """Add this action to the verb."""
    about = "Show how an installed board and its guard do."
    verb = add_verb(actions, "status", about, explained(_execute))
    verb.epilog = "Exit status: 0 when the run and its guard are active, 6 when not."
    add_board_name(verb, otherwise="all that are installed")
    verb.add_argument("--json", action="store_true", help="print it as JSON")


def _execute(arguments: argparse.Namespace) -> int:
    place = target(None, dry_run=True)
    if arguments.board is not None:
        demand_known(arguments.board, place)
    require_systemd()
    boards = [arguments.board] if arguments.board else installed_boards(place)
    if not boards:
        raise StepFailed(
            "no board is installed", expected="`firmware-runtime service install BOARD`"
        )
    return show_status(boards, as_json=arguments.json)


def show_status(boards: Sequence[str], *, as_json: bool = False) -> int:
    """Print how these boards do."""
    states = {
        board: {name: state_of(instance(service, board)) for name, service in SERVICES.items()}
        for board in boards
    }
    if as_json:
        print(json.dumps(service_document(states), indent=2))
    else:
        print("\n".join(line for board in boards for line in service_lines(board, states[board])))
    active = all(unit.is_active for units in states.values() for unit in units.values())
    return Status.OK if active else Status.NOTHING_HAPPENED


def explained(execute: Execute) -> Execute:
    """The action, with its errors explained: 2 if nothing was touched, 6 if it was begun."""

    def action(arguments: argparse.Namespace) -> int:
        try:
            return execute(arguments)
        except InstallationRefused as error:
            return _refuse(error, Status.BAD_INPUT)
        except StepFailed as error:
            return _refuse(error, Status.NOTHING_HAPPENED)

    return action


def _refuse(error: Exception, status: Status) -> int:
    print(f"firmware-runtime: {error}", file=sys.stderr)
    return status


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
        raise ConfigError(name, [f"unknown board; {expected_one_of(name, known)}"])
