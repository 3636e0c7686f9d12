"""`firmware-runtime service status [BOARD]`: how systemd and the statistics say a board does.

BOARD is one that is installed on a system, by the name of its kind or by the robot's own.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict

from firmware_runtime.board import installed as kinds
from firmware_runtime.board.local_settings import SETTINGS
from firmware_runtime.cli.arguments import Execute, SubParsers, add_verb
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import (
    ConfigError,
    InstallationRefused,
    StatisticsFileError,
    Status,
    StepFailed,
    did_you_mean,
)
from firmware_runtime.host.installation.plan import GUARD, RUNTIME, boards_with_settings, instance
from firmware_runtime.host.installation.target import (
    Target,
    UnitState,
    require_systemd,
    state_of,
    target,
)
from firmware_runtime.host.installation.uninstall import installed_boards
from firmware_runtime.runs.restarts import pause_after, read_starts
from firmware_runtime.statistics.paths import find_statistics, places
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.summary import summary

SCHEMA = 1


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
        board: {name: state_of(instance(service, board)) for name, service in _SERVICES.items()}
        for board in boards
    }
    if as_json:
        print(json.dumps(_as_json(states), indent=2))
    else:
        print("\n".join(line for board in boards for line in _lines(board, states[board])))
    active = all(unit.is_active for units in states.values() for unit in units.values())
    return Status.OK if active else Status.NOTHING_HAPPENED


_SERVICES = {"runtime": RUNTIME, "guard": GUARD}


def _as_json(states: dict[str, dict[str, UnitState]]) -> dict[str, object]:
    return {
        "schema": SCHEMA,
        "boards": {
            board: {
                **{name: asdict(unit) for name, unit in units.items()},
                "failed_starts": _failed_starts(board),
                "statistics": _summary_or_none(board),
            }
            for board, units in states.items()
        },
    }


def _lines(board: str, units: dict[str, UnitState]) -> Iterator[str]:
    yield f"{board:10}  {'state':22} {'since':30} {'process':>8} {'restarts':>9} {'watchdog':>9}"
    for name, unit in units.items():
        state = f"{unit.active or 'unknown'} ({unit.sub or 'unknown'})"
        since, process = unit.since or "-", str(unit.pid or "-")
        watchdog = unit.watchdog or "-"
        yield f"  {name:8}  {state:22} {since:30} {process:>8} {unit.restarts:>9} {watchdog:>9}"
        if unit.result not in {"", "success"}:
            yield f"{'':12}ended with {unit.result}"
        if unit.says:
            yield f"{'':12}{unit.says}"
    if failed := _failed_starts(board):
        pause_s = pause_after(failed) / SECOND
        yield f"  starts      {failed} failed in a row before this one, which waited {pause_s:g} s"
    yield f"  statistics  {_summary_or_reason(board)}"


def _failed_starts(board: str) -> int:
    """Starts in a row that failed before the one under way; 0 after a minute of health."""
    found = (read_starts(path) for path in places(board))
    return next((starts.failed for starts in found if starts is not None), 0)


def _summary(board: str) -> str:
    """The run under way, or the last, in a line. Raises StatisticsFileError."""
    return summary(read_statistics(find_statistics(board)).figures())


def _summary_or_none(board: str) -> str | None:
    with suppress(StatisticsFileError):
        return _summary(board)
    return None


def _summary_or_reason(board: str) -> str:
    try:
        return _summary(board)
    except StatisticsFileError as error:
        return str(error)


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
        expected = f"expected one of {', '.join(known)}{did_you_mean(name, known)}"
        raise ConfigError(name, [f"unknown board; {expected}"])
