"""`firmware-runtime safe-state BOARD`: every output off, and seen to stay so."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_doubles,
    add_statistics,
    add_verb,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status, text_of
from firmware_runtime.runs.active_runs import folders_of_runs
from firmware_runtime.runs.outputs import (
    forget_settings,
    kept_for,
    kept_settings,
    switched_off,
)
from firmware_runtime.runs.safe_state import BETWEEN, WATCH, SafeState
from firmware_runtime.statistics.file_header import STATISTICS, driver_of
from firmware_runtime.statistics.paths import Companion, default_path, directories
from firmware_runtime.system.signals import until_signal
from firmware_runtime.system.terminal import print_line
from firmware_runtime.system.this_process import is_running

TIMEOUT = 2 * SECOND
"""Ns in which it is tried again: a stuck bus may come free, a run that is busy may acknowledge;
systemd waits for longer."""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Switch every output of a board full-off, whatever drives it."
    verb = add_verb(verbs, "safe-state", summary, execute)
    add_board(verb)
    add_doubles(verb)
    add_statistics(verb, "where the run kept its statistics")
    verb.add_argument(
        "--reason", default="requested", help="why, for the journal; systemd's $SERVICE_RESULT"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Take the right to drive from every run, and write until all chips have acknowledged.

    A signal ends the trying again, but never between two chips.
    """
    meant, statistics, faults = _what_is_meant(arguments)
    safe_state = SafeState(meant, arguments.doubles, statistics)
    with until_signal() as signal:
        failed = _switch_off(safe_state, lambda: signal.wait(BETWEEN / SECOND))
    warnings = safe_state.warnings()
    if not failed and safe_state.is_over:
        for path in {*safe_state.statistics_found, statistics}:
            forget_settings(path)
    safe_state.close()
    for sentence in (*faults, *warnings, *(f"not made safe: {each}" for each in failed)):
        print_line(f"firmware-runtime: {sentence}", sys.stderr)
    if failed and _has_doubles_of_its_own(statistics):
        fault = f"the run at {statistics} is on doubles of its own, which end with it"
        expected = "expected served ones (`doubles serve`), and --doubles here"
        print_line(f"firmware-runtime: {fault}; {expected}", sys.stderr)
    if not failed:
        print_line(f"{meant[0].name}: all outputs off ({arguments.reason})", sys.stdout)
    return Status.NOT_SAFE if failed else Status.OK


def _switch_off(safe_state: SafeState, wait: Callable[[], bool]) -> list[str]:
    """Return what is on, or may be; `wait` lets some time pass, and ends it if a signal came."""
    give_up_at = monotonic_ns() + TIMEOUT
    safe_state.take_right()
    failed = safe_state.make_safe()
    safe_state.warn_runs_to_come()
    safe_state.find_runs()
    while failed or not safe_state.has_acknowledged():
        if monotonic_ns() >= give_up_at or wait():
            break
        failed = safe_state.make_safe()
    if failed:
        return failed
    failed = safe_state.make_safe()  # a write that was under way is over by now
    return failed or safe_state.stays_off(give_up_at + WATCH, wait)


def _what_is_meant(arguments: argparse.Namespace) -> tuple[list[Board], Path | None, list[str]]:
    """The board as its file has it, and as a run has left it, where that means other outputs.

    With it where that run keeps its statistics, and what is wrong with the file. Raises ConfigError
    for a file that is not sound, unless a run has left something.
    """
    try:
        stated = chosen_board(arguments.board, arguments.assignments)
    except ConfigError as error:
        for possible in _possible(arguments):
            left = kept_settings(possible)
            if left is not None:
                kept = Companion.SETTINGS.beside(possible)
                taken = f"its last run's settings were taken instead, from {kept}"
                return [left], possible, [text_of(error), taken]
        raise
    statistics = _statistics(arguments, stated.name)
    left = kept_settings(statistics)
    if left is None or _off(left, arguments) == _off(stated, arguments):
        return [stated], statistics, []
    return [stated, left], statistics, []


def _possible(arguments: argparse.Namespace) -> Iterator[Path]:
    """Where a run may keep its statistics whose board's file cannot be read any more."""
    if arguments.statistics is not None:
        yield arguments.statistics
        return
    yield from kept_for(arguments.board, directories())
    yield from kept_for(arguments.board, folders_of_runs())
    with suppress(StatisticsFileError, OSError):
        yield default_path(Path(arguments.board).stem)


def _statistics(arguments: argparse.Namespace, board: str) -> Path | None:
    """Where a run would keep them; that there is no such place does not keep outputs on."""
    if arguments.statistics is not None:
        stated: Path = arguments.statistics
        return stated
    with suppress(StatisticsFileError, OSError):
        return default_path(board)
    return None


def _has_doubles_of_its_own(statistics: Path | None) -> bool:
    """Whether a run lives there whose outputs no other process reaches."""
    if statistics is None:
        return False
    try:
        with STATISTICS.opened(statistics) as file:
            run = driver_of(file)
    except StatisticsFileError:
        return False
    return run.saved is None and is_running(run.writer) and not run.has_outputs


def _off(board: Board, arguments: argparse.Namespace) -> list[str]:
    return switched_off(board, arguments.doubles)
