"""`firmware-runtime safe-state BOARD`: write full-off to every chip, and nothing else."""

import argparse
import sys
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns

from boards.registry import Board
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.guard import add_doubles
from firmware_runtime.cli.outputs import Outputs, switched_off
from firmware_runtime.cli.readers_gone import readers_may_go
from firmware_runtime.cli.settings_in_force import forget_settings, kept_settings
from firmware_runtime.cli.status import Status
from firmware_runtime.cli.until_signal import until_signal
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import BoardError
from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.paths import default_path

PATIENCE = 2 * SECOND
"""Ns in which it is tried again: a stuck bus may come free; systemd waits for longer."""
BETWEEN = 20 * MILLISECOND


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Switch every output of a board full-off, whoever drives it."
    verb = add_verb(verbs, "safe-state", summary, execute)
    add_board(verb)
    add_doubles(verb)
    verb.add_argument(
        "--statistics", type=Path, metavar="FILE", help="where the run kept its statistics"
    )
    verb.add_argument(
        "--reason", default="asked for", help="why, for the journal; systemd's $SERVICE_RESULT"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write until all chips have acknowledged, at most for two seconds.

    A signal ends the trying again, but never between two chips.
    """
    meant, statistics, faults = _what_is_meant(arguments)
    outputs = [Outputs(board, arguments.doubles, statistics) for board in meant]

    def make_safe() -> list[str]:
        return [failure for each in outputs for failure in each.make_safe()]

    give_up_at = monotonic_ns() + PATIENCE
    with until_signal() as signal:
        failed = make_safe()
        while failed and monotonic_ns() < give_up_at and not signal.wait(BETWEEN / SECOND):
            failed = make_safe()
    for each in outputs:
        each.close()
    if not failed:
        forget_settings(statistics)
    with readers_may_go():
        for fault in faults:
            print(f"firmware-runtime: {fault}", file=sys.stderr)
        for failure in failed:
            print(f"firmware-runtime: not made safe: {failure}", file=sys.stderr)
        if not failed:
            print(f"{meant[0].name}: all outputs off ({arguments.reason})")
    return Status.NOT_SAFE if failed else Status.OK


def _what_is_meant(arguments: argparse.Namespace) -> tuple[list[Board], Path | None, list[str]]:
    """The board as its file has it, and as a run has left it, where that means other outputs.

    With it where that run keeps its statistics, and what is wrong with the file. Raises BoardError
    for a file that is not sound, unless a run has left something.
    """
    try:
        stated = chosen_board(arguments.board, arguments.assignments)
    except BoardError as error:
        statistics = _statistics(arguments, Path(arguments.board).stem)
        left = kept_settings(statistics)
        if left is None:
            raise
        return [left], statistics, [str(error), "its last run's settings were taken instead"]
    statistics = _statistics(arguments, stated.name)
    left = kept_settings(statistics)
    if left is None or _off(left, arguments) == _off(stated, arguments):
        return [stated], statistics, []
    return [stated, left], statistics, []


def _statistics(arguments: argparse.Namespace, board: str) -> Path | None:
    """Where a run would keep them; that there is no such place keeps nobody from switching off."""
    if arguments.statistics is not None:
        stated: Path = arguments.statistics
        return stated
    with suppress(StatisticsFileError, OSError):
        return default_path(board)
    return None


def _off(board: Board, arguments: argparse.Namespace) -> list[str]:
    return switched_off(board, arguments.doubles)
