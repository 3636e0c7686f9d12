"""`firmware-runtime record BOARD --into FOLDER`: keep what a board's runs leave behind."""

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_statistics,
    add_verb,
    positive,
    whole,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.recording.blackbox.excerpts import Pieces
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.recorder import Recorder
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.this_process import keep_off

LOOK_EVERY_S = 0.1

_ABOUT = """
It reads what the run and the guard write anyway, in a process of its own, and goes on from run to
run until a signal comes. Each run leaves its statistics (for stats, report, --diff, --merge), and
for each late activation and each takeover by the guard a piece of the run's recording; a run that
failed or was killed leaves all that was recorded of it. `recordings` lists these, replay runs them
again, perfetto shows what ran when in them.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Keep the statistics of a board's runs, and recordings of what went wrong in them."
    verb = add_verb(verbs, "record", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    verb.add_argument(
        "--into",
        type=Path,
        metavar="FOLDER",
        help="where to keep it; default in a systemd unit: its state directory",
    )
    verb.add_argument(
        "--late-us",
        type=positive,
        metavar="US",
        help="lateness that is worth a piece; default: the least tolerance of the board's models",
    )
    verb.add_argument(
        "--runs",
        type=partial(whole, least=1),
        default=50,
        metavar="N",
        help="how many runs to keep (50)",
    )
    verb.add_argument(
        "--budget",
        type=positive,
        metavar="MIB",
        help="what recordings may take of the disk, the oldest make room for new ones; default: "
        "the board's recording.keep_mib (1024)",
    )
    add_statistics(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Record until a signal comes."""
    board = chosen_board(arguments.board, arguments.assignments)
    keep_off(board.settings.executive.cpus)
    notices = Notices.from_environment()

    def log(what: str) -> None:
        print(f"recorder: {what}", flush=True)
        notices.status(what)

    late = None if arguments.late_us is None else round(arguments.late_us * MICROSECOND)
    kept = arguments.statistics or default_path(board.name)
    stated = board.settings.recording
    budget = round((arguments.budget or stated.keep_mib) * (1 << 20))
    pieces = Pieces(kept, budget, round(stated.sync_s * SECOND), log)
    recorder = Recorder(kept, _folder(arguments.into), arguments.runs, late, log, pieces)
    with until_signal() as signal:
        log(f"waiting for a run at {kept}")
        notices.ready()
        try:
            _record(recorder, signal, notices)
        except StatisticsFileError as error:  # a full disk is no bad input: systemd tries again
            print(f"firmware-runtime: {error}", file=sys.stderr)
            return Status.NOTHING_HAPPENED
    return Status.OK


def _record(recorder: Recorder, signal: UntilSignal, notices: Notices) -> None:
    while not signal.wait(LOOK_EVERY_S):
        recorder.poll(monotonic_ns())
        notices.alive()
    notices.stopping()
    recorder.close(monotonic_ns())


def _folder(stated: Path | None) -> Path:
    """Where to keep it, made if it is not there. Raises ConfigError."""
    from_systemd = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    if stated is None and not from_systemd:
        raise ConfigError("record", ["--into: expected a folder, as no systemd unit gives one"])
    folder = stated or Path(from_systemd)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(str(folder), [f"cannot be made ({error.strerror})"]) from error
    if not os.access(folder, os.W_OK):
        raise ConfigError(str(folder), ["cannot be written, expected a folder that can"])
    return folder
