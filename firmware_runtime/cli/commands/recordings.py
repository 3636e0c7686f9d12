"""`firmware-runtime recordings list|keep|recover|collect`: what runs leave behind."""

import argparse
import json
import os
import sys
from functools import partial
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_output,
    add_recorded,
    add_statistics,
    add_verb,
    positive,
    whole,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.recording.blackbox.excerpts import Pieces
from firmware_runtime.recording.blackbox.layout import PREFIX_SIZE, file_of, is_of_another_format
from firmware_runtime.recording.blackbox.listing import listed, span_of, table_of, without_copies
from firmware_runtime.recording.blackbox.locations import (
    find_recording,
    kept_recordings,
    last_recordings,
)
from firmware_runtime.recording.blackbox.reader import another_format, read_recording
from firmware_runtime.recording.blackbox.ring_file import whole_content_of
from firmware_runtime.recording.blackbox.salvage import save
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.recorder import Recorder
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.this_process import keep_off

LOOK_EVERY_S = 0.1
_KEEP = """
The file can be sent, and is without the part of the recording's memory that is not in use.
"""
_COLLECT = """
It reads what the run and the guard write anyway, in a process of its own, and goes on from run to
run until a signal comes. Each run leaves its statistics (for stats, report, --diff, --merge), and
for each late activation and each takeover by the guard a piece of the run's recording; a run that
failed or was killed leaves all that was recorded of it.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "List the recordings of runs; keep one as a file; recover one; collect them."
    verb = verbs.add_parser("recordings", help=summary, description=summary)
    verb.set_defaults(execute=_list, board=None, folder=None, json=False)
    actions = verb.add_subparsers(metavar="ACTION", help="default: list")
    _add_list_to(actions)
    about = "Write a recording into a file that can be sent."
    keep = add_verb(actions, "keep", about, _keep)
    keep.epilog = _KEEP
    add_recorded(keep)
    add_output(keep, "the file to write; default: the run's name, here")
    about = "Save what is whole of a recording that was cut or damaged, and say what is lost."
    recover = add_verb(actions, "recover", about, _recover)
    add_recorded(recover)
    add_output(recover, "the file to write", required=True)
    _add_collect_to(actions)


def _add_list_to(actions: SubParsers) -> None:
    about = "List the recordings of the last runs, and those that were collected of earlier ones."
    verb = add_verb(actions, "list", about, _list)
    verb.epilog = "The name in front is what replay, debug and export take."
    verb.add_argument("board", metavar="BOARD", nargs="?", help="of this board only")
    verb.add_argument(
        "--in", type=Path, metavar="FOLDER", dest="folder", help="those in this folder only"
    )
    verb.add_argument("--json", action="store_true", help="print the list as JSON")


def _add_collect_to(actions: SubParsers) -> None:
    about = "Keep the statistics of a board's runs, and recordings of what went wrong in them."
    verb = add_verb(actions, "collect", about, _collect)
    verb.epilog = _COLLECT
    verb.add_argument("board", metavar="BOARD", help="a board's name, or the path of a board.toml")
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


def _list(arguments: argparse.Namespace) -> int:
    """Print a line for each."""
    rows = without_copies([listed(path) for path in _paths(arguments.board, arguments.folder)])
    if arguments.json:
        print(json.dumps([each.as_json() for each in rows], allow_nan=False))
    else:
        of = "" if arguments.board is None else f" of {arguments.board}"
        print("\n".join(table_of(rows)) if rows else f"no recordings{of}")
    return Status.OK


def _paths(board: str | None, folder: Path | None) -> list[Path]:
    if folder is None:
        return [*last_recordings(board), *kept_recordings(board)]
    if not folder.is_dir():
        raise ConfigError.of_one("--in", f"{folder}: no folder", expected="one with recordings")
    return sorted(each for each in folder.glob("*.recording") if each.name.startswith(board or ""))


def _keep(arguments: argparse.Namespace) -> int:
    """Write what of a recording is used, in order."""
    recording = read_recording(find_recording(arguments.run))
    path: Path = arguments.output or Path(f"{recording.header.run}.recording")
    content = file_of(recording.chunks)
    keep_output(path, content)
    begin, until = span_of(recording)
    print(f"{path}: {begin / SECOND:.3f} s to {until / SECOND:.3f} s, {_size(content)}")
    for fault in recording.faults():
        print(f"  not whole: {fault}")
    return Status.OK


def _recover(arguments: argparse.Namespace) -> int:
    """Write what is whole, and say what is not."""
    output, path = arguments.output, find_recording(arguments.run)
    content = whole_content_of(path)
    if is_of_another_format(content[:PREFIX_SIZE]):
        raise another_format(path, content)
    saved = save(path, content)
    keep_output(output, saved.content)
    begin, until = (each / SECOND for each in saved.span)
    lost = "; ".join(saved.lost) or "nothing"
    print(f"{output}: {saved.sections} sections, {begin:.3f} s to {until:.3f} s; lost: {lost}")
    return Status.OK


def _size(content: bytes) -> str:
    return f"{len(content) / (1 << 20):.1f} MiB"


def _collect(arguments: argparse.Namespace) -> int:
    """Collect until a signal comes."""
    board = chosen_board(arguments.board)
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
        raise ConfigError(
            "recordings collect", ["--into: expected a folder, as no systemd unit gives one"]
        )
    folder = stated or Path(from_systemd)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(str(folder), [f"cannot be made ({error.strerror})"]) from error
    if not os.access(folder, os.W_OK):
        raise ConfigError(str(folder), ["cannot be written, expected a folder that can"])
    return folder
