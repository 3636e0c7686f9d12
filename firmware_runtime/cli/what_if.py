"""`replay RUN` with BOARD, --set or --with: what would have been said; with --watch, every save."""

import argparse
import json
import sys
from pathlib import Path

from msgspec import to_builtins

from firmware_runtime.board.registry import Board
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.replayed_run import paced
from firmware_runtime.cli.written import check_page_file
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import settings_said
from firmware_runtime.recording.what_if.checkout import ask, checked_folder
from firmware_runtime.recording.what_if.what_if import Question, WhatIf, answer
from firmware_runtime.recording.what_if.what_if_report import PLOTS, what_if_page, what_if_text
from firmware_runtime.system.terminal import Progress, print_line


def what_if_run(arguments: argparse.Namespace, path: Path) -> int:
    """Find it out, print it, draw it."""
    folder = None if arguments.checkout is None else checked_folder(arguments.checkout)
    _check(arguments)
    question = Question(
        recording=str(path.absolute()),
        assignments=arguments.assignments,
        begin=arguments.begin,
        until=arguments.until,
    )
    if arguments.output is not None:
        question.plots = _plots(arguments.output)
    if arguments.watch:
        return _watch(arguments, question, folder)
    found = _here(arguments, question) if folder is None else ask(question, folder)
    _say(arguments, found)
    return Status.OK


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what does not go together."""
    given = {
        "BOARD": arguments.board is not None,
        "--speed": arguments.speed is not None,
        "--with": arguments.checkout is not None,
        "--watch": arguments.watch,
    }
    elsewhere = arguments.checkout is not None or arguments.watch
    for name in ("BOARD", "--speed"):
        if given[name] and elsewhere:
            other = "--with" if given["--with"] else "--watch"
            raise ConfigError.of_one("replay", f"{other} with {name}", expected="one of them")


def _plots(path: Path) -> int:
    check_page_file(path)
    return PLOTS


def _here(arguments: argparse.Namespace, question: Question) -> WhatIf:
    """By the code of this process."""
    board: Board | None = None
    if arguments.board is not None:
        board = chosen_board(arguments.board, arguments.assignments)
    with Progress(sys.stderr, wanted=not arguments.json, every_s=0.25) as shown:
        return answer(question, paced(arguments.speed, shown), board)


def _changed(arguments: argparse.Namespace, found: WhatIf) -> str:
    """What is tried, in words: whose code, whose settings, and which of them differ."""
    changes = []
    if arguments.checkout is not None:
        changes.append(f"the code in {arguments.checkout}")
    if arguments.board is not None:
        changes.append(f"the settings of {arguments.board}")
    if arguments.board is not None or arguments.assignments:
        changes.append(settings_said(found.settings_changed))
    return ", ".join(changes) or "the code as it is now"


def _say(arguments: argparse.Namespace, found: WhatIf) -> None:
    changed = _changed(arguments, found)
    if arguments.output is not None:
        from firmware_runtime.view.page_file import write_page  # noqa: PLC0415 -- with -o only

        write_page(what_if_page(found, changed), arguments.output)
        found.curves = {}
    if arguments.json:
        print(json.dumps(to_builtins(found), allow_nan=False))
    else:
        print("\n".join(what_if_text(found, changed)))


def _watch(arguments: argparse.Namespace, question: Question, folder: Path | None) -> int:
    """Print the answer after every save, and what is not as the last time; ends with Ctrl-C."""
    from firmware_runtime.recording.what_if.watch import Watched, answers, since  # noqa: PLC0415 -- with --watch only

    before: WhatIf | None = None
    watched = Watched(folder, read_recording(Path(question.recording)).header.code)
    for found, spent in answers(question, watched):
        if isinstance(found, ConfigError):
            print_line(f"firmware-runtime: {found}", sys.stderr)
            continue
        _say(arguments, found)
        if not arguments.json:
            for line in since(before, found):
                print(f"  {line}")
            print(f"  {spent / SECOND:.2f} s; waiting for a save (Ctrl-C ends)")
        sys.stdout.flush()
        before = found
    return Status.OK
