"""`firmware-runtime service install|uninstall|status|logs`: a board as a service of systemd."""

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.local_settings import SETTINGS
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.service_health import add_health_to
from firmware_runtime.cli.service_status import (
    add_board_name,
    add_status_to,
    demand_known,
    explained,
    show_status,
)
from firmware_runtime.errors import InstallationRefused, Status, StepFailed
from firmware_runtime.host.installation.install import Installation
from firmware_runtime.host.installation.plan import (
    GUARD,
    PROGRAM,
    RUNTIME,
    boards_with_settings,
    instance,
    settings_path,
)
from firmware_runtime.host.installation.service_text import EPISODE_FIELDS, episodes
from firmware_runtime.host.installation.target import Target, checked, own_program, runnable, target
from firmware_runtime.host.installation.uninstall import Removal
from firmware_runtime.system.packages import version_of

_INSTALL = """
Units, user, groups and rules are written again each time, /etc/firmware-runtime/BOARD.toml
once: it is yours from then on, and a board with faults in it is refused before anything is written.
Two robots of one kind have two names: a file with `name = "left"` at its top is installed as left.
With --root nothing is run: DIR is the root of a system that is being built, and the program is
expected at /opt/firmware-runtime/venv/bin there.
"""
_UNINSTALL = """
The run is stopped first, which switches its outputs off. What boards share goes with the last one.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Make a board a service of systemd, look at it, remove it."
    verb = verbs.add_parser("service", help=summary, description=summary)
    actions = verb.add_subparsers(required=True, metavar="ACTION")
    _add_install_to(actions)
    _add_uninstall_to(actions)
    add_status_to(actions)
    add_health_to(actions)
    _add_logs_to(actions)


def _add_install_to(actions: SubParsers) -> None:
    about = "Install a board and its guard, and start them now and with the machine."
    verb = add_verb(actions, "install", about, explained(_install))
    verb.epilog = _INSTALL
    verb.add_argument(
        "board", metavar="BOARD", help="a board's name, or the path of a board.toml or its folder"
    )
    _add_place(verb, "write nothing and run nothing: print every file, and what would be run")
    verb.add_argument(
        "--program",
        metavar="PATH",
        help="what the units start; default: this program, with --root " + PROGRAM,
    )
    verb.add_argument(
        "--no-start", action="store_true", help="start it with the machine, but not now"
    )


def _add_uninstall_to(actions: SubParsers) -> None:
    about = "Stop a board and remove what install wrote for it."
    verb = add_verb(actions, "uninstall", about, explained(_uninstall))
    verb.epilog = _UNINSTALL
    add_board_name(verb)
    _add_place(verb, "remove nothing and run nothing: print what would be")
    verb.add_argument(
        "--purge",
        action="store_true",
        help="your copy of the settings and the statistics too; with the last board the user too",
    )


def _add_logs_to(actions: SubParsers) -> None:
    about = "Show what a board and its guard wrote to the journal."
    verb = add_verb(actions, "logs", about, explained(_logs))
    add_board_name(verb)
    verb.add_argument("--follow", action="store_true", help="go on with what comes")
    verb.add_argument(
        "--since", metavar="WHEN", help="as journalctl takes it, such as '10 min ago' or 09:30"
    )
    verb.add_argument(
        "--episodes",
        action="store_true",
        help="only episodes of overruns, as a table: when, model, " + ", ".join(EPISODE_FIELDS),
    )


def _add_place(verb: argparse.ArgumentParser, dry_run: str) -> None:
    verb.add_argument(
        "--root", type=Path, metavar="DIR", help="the system below this directory; runs nothing"
    )
    verb.add_argument("--dry-run", action="store_true", help=dry_run)


def _install(arguments: argparse.Namespace) -> int:
    board = _board(arguments.board, target(arguments.root, dry_run=True))
    place = target(arguments.root, dry_run=arguments.dry_run)
    program = _program(arguments, place, board)
    installation = Installation(board, place, program, version_of("firmware-runtime") or "?")
    start = not arguments.no_start
    if arguments.dry_run:
        installation.preview(print, start=start)
        return Status.OK
    for node in installation.missing_nodes():
        _warn(f"{node} does not exist; `firmware-runtime doctor {board.name}` says what to do")
    installation.carry_out(_log, start=start)
    if place.is_live and installation.changes_units:
        print(f"a robot that ran already takes this up at: {_restart(board.name)}")
    return show_status([board.name]) if place.is_live and start else Status.OK


def _board(board: str, place: Target) -> registry.Board:
    """A kind or a file; or a robot that was installed there before, by its own name."""
    copy = place.tree.where(settings_path(board))
    if registry.is_name(board) and board not in kinds.names() and copy.exists():
        return registry.load_copy(copy, board)
    others = boards_with_settings(place.tree.names(SETTINGS))
    return registry.load(board, others=[each for each in others if each not in kinds.names()])


def _program(arguments: argparse.Namespace, place: Target, board: registry.Board) -> str:
    """What the units are to start. Raises InstallationRefused."""
    if not place.is_live:
        return checked(arguments.program or PROGRAM)
    try:
        return (
            runnable(arguments.program)
            if arguments.program
            else own_program(kinds.shipped_file(board.kind))
        )
    except InstallationRefused as error:
        if not arguments.dry_run:
            raise
        _warn(f"without --dry-run this is refused: {error}")
        return PROGRAM


def _uninstall(arguments: argparse.Namespace) -> int:
    demand_known(arguments.board, target(arguments.root, dry_run=True))
    place = target(arguments.root, dry_run=arguments.dry_run)
    removal = Removal(arguments.board, place, purge=arguments.purge)
    if arguments.dry_run:
        removal.preview(print)
        return Status.OK
    removal.carry_out(_log)
    for what in removal.what_stays():
        print(f"stays: {what}; --purge removes it too")
    return Status.OK


def _restart(board: str) -> str:
    return f"systemctl restart {instance(GUARD, board)} {instance(RUNTIME, board)}"


def _logs(arguments: argparse.Namespace) -> int:
    demand_known(arguments.board, target(None, dry_run=True))
    words = _journalctl(arguments)
    try:
        if not arguments.episodes:
            os.execvp(words[0], words)  # noqa: S606 -- no shell is meant
        _print_episodes(words)
    except FileNotFoundError as error:
        raise StepFailed(
            "not found", where=words[0], expected="a system that systemd runs"
        ) from error
    return Status.OK


def _journalctl(arguments: argparse.Namespace) -> list[str]:
    units = (f"--unit={instance(service, arguments.board)}" for service in (RUNTIME, GUARD))
    words = ["journalctl", *units]
    if arguments.since is not None:
        words.append(f"--since={arguments.since}")
    if arguments.follow:
        words.append("--follow")
    if arguments.episodes:
        words += [
            "--output=json",
            "--quiet",
            f"--output-fields={','.join(('MODEL', *EPISODE_FIELDS))}",
        ]
    return words


def _print_episodes(words: Sequence[str]) -> None:
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as journal:  # noqa: S603
        assert journal.stdout is not None  # noqa: S101 -- it is a pipe
        try:
            for line in episodes(journal.stdout):
                print(line, flush=True)
        except KeyboardInterrupt:
            journal.terminate()
    if journal.returncode > 0:
        raise StepFailed(f"ended with status {journal.returncode}", where=words[0])


def _warn(what: str) -> None:
    print(f"firmware-runtime: warning: {what}", file=sys.stderr)


def _log(what: str) -> None:
    print(what, flush=True)
