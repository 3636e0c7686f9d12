"""`firmware-runtime guard BOARD`: switch off when the board's run is dead or hangs."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.outputs import Outputs
from firmware_runtime.cli.readers_gone import tell
from firmware_runtime.cli.status import Status
from firmware_runtime.cli.until_signal import until_signal
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.process import ProcessSettings, in_force
from firmware_runtime.service.guard import Guard
from firmware_runtime.service.notices import Notices
from firmware_runtime.telemetry.paths import default_path
from firmware_runtime.telemetry.refusals import refusals
from firmware_runtime.telemetry.takeovers import TakeoverFile

_ABOUT = """
It holds the buses and the run's heartbeat, nothing else, and acts within 0.2 s ([guard] stall_s of
the board): full-off to every chip, again until all have acknowledged. What it switched off stays
off until the run is armed anew. Start it before the run; it waits for one, and for the next. Where
it may not open a bus of a run that lives it ends with status 3, and is no guard to that run.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Watch over a board's run from another process; switch off when it is dead or hangs."
    verb = add_verb(verbs, "guard", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    add_doubles(verb)
    verb.add_argument(
        "--statistics", type=Path, metavar="FILE", help="where the run keeps its statistics"
    )


def add_doubles(verb: argparse.ArgumentParser) -> None:
    """Add --doubles PATH."""
    verb.add_argument(
        "--doubles", type=Path, metavar="PATH", help="on the doubles that are served at PATH"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Watch until a signal comes; a run that still goes on then is left alone."""
    board = chosen_board(arguments.board, arguments.assignments)
    path = arguments.statistics or default_path(board.name)
    outputs = Outputs(board, arguments.doubles, path)
    notices = Notices.from_environment()

    def say(what: str) -> None:
        tell(f"guard: {what}", sys.stdout)
        notices.status(what)

    stall = seconds(board.settings.guard.stall_s)
    guard = Guard(path, outputs, stall, say, TakeoverFile(path).write)
    priority = min(board.settings.executive.fifo_priority + 1, 99)
    asked = ProcessSettings(
        fifo_priority=priority if board.settings.executive.fifo_priority > 0 else 0,
        lock_memory=board.settings.executive.lock_memory,
    )
    with in_force(asked, MonotonicClock()) as granted, until_signal() as signal:
        for refusal in refusals({"settings": granted}):
            say(refusal)
        say(f"watching {path}")
        notices.ready()
        while not signal.came:
            guard.look()
            notices.alive()
            guard.wait(signal.fileno())
    notices.stopping()
    outputs.close()
    for failure in guard.failed:
        tell(f"firmware-runtime: not made safe: {failure}", sys.stderr)
    return Status.NOT_SAFE if guard.failed else Status.OK
