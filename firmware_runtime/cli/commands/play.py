"""`firmware-runtime play [BOARD]`: doubles, guard, run and page at once, to be played with.

Each is a process of its own, as on a robot: what dies on the page dies as it would there.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Final

from firmware_runtime.board.assignments import set_words
from firmware_runtime.cli.arguments import SubParsers, add_set, add_verb, port
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.programs import end_within
from firmware_runtime.system.signals import UntilSignal, until_signal

_ABOUT = """
Starts the board's doubles (`doubles serve`), a guard, a run on them that is armed, and `view` with
arming allowed. Ctrl-C ends all of them. What moves is a model of the robot: no chip is touched.
"""
START_WITHIN_S: Final = 30.0
END_WITHIN_S: Final = 10.0
_LONG: Final = ("--for", "86400")


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Start a robot on doubles, its guard and its page: see it, break it, rewind it."
    verb = add_verb(verbs, "play", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", default="tachobot", help="default: tachobot"
    )
    add_set(verb, "override one number of board.toml, such as controller.kp=0.8")
    verb.add_argument(
        "--port", type=port, default=8765, metavar="N", help="of the page; default 8765"
    )
    verb.add_argument("--no-browser", action="store_true", help="do not open a browser")


def execute(arguments: argparse.Namespace) -> int:
    """Start them one after the other, and end them in reverse when a signal comes."""
    module_of_extra("aiohttp", "view")
    board = chosen_board(arguments.board, arguments.assignments)
    robot = [arguments.board, *set_words(arguments.assignments)]
    statistics = default_path(board.name)
    page = ["--statistics", str(statistics), "--port", str(arguments.port), "--allow-arm"]
    page += ["--no-browser"] if arguments.no_browser else []
    with TemporaryDirectory(prefix="firmware-runtime-") as folder, ExitStack() as undo:
        signal = undo.enter_context(until_signal())
        doubles = str(Path(folder) / "doubles")
        start = undo.enter_context
        start(_running(["doubles", "serve", *robot, "--socket", doubles], "serving", signal))
        start(_running(["guard", *robot, "--doubles", doubles], "guard: watching", signal))
        run = start(_running(["run", *robot, "--doubles", doubles, "--arm", *_LONG], "", signal))
        _await_statistics(statistics, run, signal)
        start(_running(["view", *page], "http", signal, is_shown=True))
        print("Ctrl-C ends it", flush=True)
        signal.wait()
    return Status.OK


@contextmanager
def _running(
    words: list[str], ready: str, signal: UntilSignal, *, is_shown: bool = False
) -> Iterator["subprocess.Popen[str]"]:
    """A verb of this program in a process of its own, once it has said that it is ready.

    Raises SystemExit or ConfigError for one that ends before.
    """
    process = subprocess.Popen(  # noqa: S603 -- this program itself
        [sys.executable, "-m", "firmware_runtime.cli", *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE if ready else None,
        text=True,
        process_group=0,
    )
    try:
        if ready:
            _await_line(process, ready, words[0], signal, is_shown=is_shown)
        yield process
    finally:
        process.terminate()
        end_within(process, END_WITHIN_S)
        if process.stdout is not None:
            process.stdout.close()


def _await_line(
    process: "subprocess.Popen[str]",
    ready: str,
    name: str,
    signal: UntilSignal,
    *,
    is_shown: bool,
) -> None:
    """Wait for the line with that word. What the process prints later goes nowhere.

    Raises SystemExit with the status of a process that refuses, ConfigError for one that dies.
    """
    assert process.stdout is not None  # noqa: S101 -- a pipe, as it was asked for
    for line in process.stdout:
        if is_shown:
            print(line, end="", flush=True)
        if ready in line or signal.came:
            return
    if (status := process.wait()) > 0:  # it has said why
        raise SystemExit(status)
    fault = f"ended with status {status} before it was ready"
    raise ConfigError.of_one(f"play: {name}", fault)


def _await_statistics(path: Path, run: "subprocess.Popen[str]", signal: UntilSignal) -> None:
    """Wait until the run keeps its statistics. Raises ConfigError if it does not."""
    until = monotonic() + START_WITHIN_S
    while monotonic() < until and run.poll() is None and not signal.wait(0.05):
        with suppress(StatisticsFileError):
            if read_statistics(path).header.writer.pid == run.pid:
                return
    if not signal.came:
        within = f" within {START_WITHIN_S:g} s"
        ended = "" if run.poll() is None else f"; it ended with status {run.returncode}"
        fault = f"no run has begun{ended or within}"
        raise ConfigError.of_one("play: run", fault, expected=f"its statistics at {path}")
