"""`firmware-runtime top [BOARD]`: a run's timing, live in the terminal."""

import argparse
import os
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from select import select

from firmware_runtime.cli.after_virtual_run import say_if_last_run_was_virtual
from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb, positive
from firmware_runtime.errors import Status
from firmware_runtime.statistics.paths import find_statistics
from firmware_runtime.statistics.watched_file import Watched
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import UntilSignal, until_signal


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Show a run's timing live; q quits, space pauses. Needs the extra `top`."
    verb = add_verb(verbs, "top", summary, execute)
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", help="a board's name; default: whatever ran last"
    )
    add_statistics(verb, "read this file instead")
    verb.add_argument(
        "--interval",
        type=positive,
        default=1.0,
        metavar="SECONDS",
        dest="interval_s",
        help="from one reading to the next; default 1",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Show it until q; once, where there is no terminal to show it in."""
    drawing = module_of_extra("firmware_runtime.view.live_screen", "top")
    console = module_of_extra("rich.console", "top").Console(highlight=False)
    path = arguments.statistics or find_statistics(arguments.board)
    watched = Watched(path)
    say_if_last_run_was_virtual(path, watched.now)
    if not (sys.stdin.isatty() and console.is_terminal):
        console.print(drawing.screen(watched.now, watched.lately, console.size, paused=False))
        print("firmware-runtime: no terminal here, so this was shown once", file=sys.stderr)
        return Status.OK
    live = module_of_extra("rich.live", "top").Live(
        console=console, screen=True, auto_refresh=False, vertical_overflow="crop"
    )
    with until_signal() as signal, _keys() as keys, live:
        while not signal.came and watched.is_wanted:
            picture = drawing.screen(
                watched.now, watched.lately, console.size, paused=watched.is_paused
            )
            live.update(picture, refresh=True)
            watched.obey(_key(keys, signal, arguments.interval_s))
    return Status.OK


def _key(keys: int, signal: UntilSignal, timeout_s: float) -> bytes:
    """The key pressed within that time, if one was."""
    ready, _, _ = select([keys, signal.fileno()], (), (), timeout_s)
    return os.read(keys, 1) if keys in ready else b""


@contextmanager
def _keys() -> Iterator[int]:
    """Give the terminal's keys as they are pressed; afterwards it is as it was."""
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield descriptor
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
