"""`firmware-runtime guard BOARD`: switch off when the board's run is dead or hangs."""

import argparse
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import monotonic_ns
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_doubles,
    add_statistics,
    add_verb,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.errors import Status
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.process import ProcessSettings, in_force
from firmware_runtime.runs.guard import Guard
from firmware_runtime.runs.outputs import Outputs
from firmware_runtime.runs.restarts import Restarts, counted
from firmware_runtime.statistics.paths import default_path, of_guard
from firmware_runtime.statistics.summary import refusals
from firmware_runtime.statistics.takeovers import note_takeover
from firmware_runtime.system.messages import Notices, Sentences
from firmware_runtime.system.packages import refuse_ros
from firmware_runtime.system.signals import UntilSignal, until_signal

START_WITHIN: Final = 60 * SECOND
"""How long a start may take, ns: `TimeoutStartSec=` of the unit."""
_ABOUT = """
It holds the buses and the run's heartbeat, nothing else, and acts within 0.2 s ([guard] stall_s of
the board): full-off to every chip, again until all have acknowledged. What it switched off stays
off until the run is armed again. Start it before the run; it waits for one, and for the next. Where
it may not open a bus of a run that lives it ends with status 3, and is no guard to that run.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Watch over a board's run from another process; switch off when it is dead or hangs."
    verb = add_verb(verbs, "guard", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    add_doubles(verb)
    add_statistics(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Watch until a signal comes; a run that still goes on then is left alone.

    All that a takeover takes is imported, opened and locked before it says that it watches.
    """
    refuse_ros()
    board = chosen_board(arguments.board, arguments.assignments)
    path = arguments.statistics or default_path(board.name)
    notices = Notices.from_environment()
    watch = partial(_watch, board, path, arguments.doubles, notices)
    return counted(watch, of_guard(path), notices, START_WITHIN, "nothing is watched")


def _watch(
    board: Board, path: Path, doubles: Path | None, notices: Notices, restarts: Restarts | None
) -> int:
    outputs = Outputs(board, doubles, path)
    printed, errors = Sentences(sys.stdout), Sentences(sys.stderr)

    def say(what: str) -> None:
        printed.say(f"guard: {what}")
        notices.status(what)

    stall = seconds(board.settings.guard.stall_s)
    guard = Guard(path, outputs, stall, say, partial(note_takeover, path))
    outputs.prepare()
    with in_force(_asked(board), MonotonicClock()) as granted, until_signal() as signal:
        if not board.settings.executive.lock_memory:
            del granted["lock_memory"]  # not the board's wish: where it is refused, so be it
        for refusal in refusals(granted):
            say(refusal)
        say(f"watching {path}")
        notices.ready()
        _look_until(signal, guard, notices, restarts)
    notices.stopping()
    outputs.close()
    for failure in guard.failed:
        errors.say(f"firmware-runtime: not made safe: {failure}")
    return Status.NOT_SAFE if guard.failed else Status.OK


def _look_until(
    signal: UntilSignal, guard: Guard, notices: Notices, restarts: Restarts | None
) -> None:
    begun_at = monotonic_ns()
    while not signal.came:
        guard.poll()
        with suppress(MemoryError):
            notices.alive()
            if restarts is not None:
                restarts.between_steps(monotonic_ns() - begun_at, SECOND)
        guard.wait(signal.fileno())


def _asked(board: Board) -> ProcessSettings:
    """Before the run it watches, so that a loop without an end leaves it the processor."""
    fifo = board.settings.executive.fifo_priority
    return ProcessSettings(fifo_priority=min(fifo + 1, 99) if fifo > 0 else 0, lock_memory=True)
