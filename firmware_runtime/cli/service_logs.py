"""`firmware-runtime service logs BOARD`: the journal of a board and its guard."""

import argparse
import json
import os
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from typing import Any

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.board_name import add_board_name, demand_known
from firmware_runtime.cli.service_status import explained
from firmware_runtime.host.installation.errors import StepFailed
from firmware_runtime.host.installation.places import GUARD, RUNTIME, instance
from firmware_runtime.host.installation.target import target
from firmware_runtime.status import Status

_FIELDS = ("PERIOD_US", "LATE_US", "MISSED", "CAUSE")
"""What the journal's entry on an episode of overruns has, and no other entry."""
_MICROSECONDS = 1_000_000


def add_logs_to(actions: SubParsers) -> None:
    """Add this action to the verb."""
    about = "Show what a board and its guard wrote to the journal."
    verb = add_verb(actions, "logs", about, explained(_execute))
    add_board_name(verb)
    verb.add_argument("--follow", action="store_true", help="go on with what comes")
    verb.add_argument(
        "--since", metavar="WHEN", help="as journalctl takes it, such as '10 min ago' or 09:30"
    )
    verb.add_argument(
        "--episodes",
        action="store_true",
        help="only episodes of overruns, as a table: when, model, " + ", ".join(_FIELDS),
    )


def _execute(arguments: argparse.Namespace) -> int:
    demand_known(arguments.board, target(None, dry_run=True))
    words = _journalctl(arguments)
    try:
        if not arguments.episodes:
            os.execvp(words[0], words)  # noqa: S606 -- no shell is meant
        _print_episodes(words)
    except FileNotFoundError as error:
        raise StepFailed(f"{words[0]}: not found; expected a system that systemd runs") from error
    return Status.OK


def _journalctl(arguments: argparse.Namespace) -> list[str]:
    units = (f"--unit={instance(service, arguments.board)}" for service in (RUNTIME, GUARD))
    words = ["journalctl", *units]
    if arguments.since is not None:
        words.append(f"--since={arguments.since}")
    if arguments.follow:
        words.append("--follow")
    if arguments.episodes:
        words += ["--output=json", "--quiet", f"--output-fields={','.join(('MODEL', *_FIELDS))}"]
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
        raise StepFailed(f"{words[0]}: ended with status {journal.returncode}")


def episodes(entries: Iterable[str]) -> Iterator[str]:
    """A line for every episode among journal entries in JSON; a heading first."""
    yield f"{'when':26}  {'model':24} {'PERIOD_US':>9} {'LATE_US':>9} {'MISSED':>6}  CAUSE"
    for entry in map(json.loads, entries):
        if all(field in entry for field in _FIELDS):
            yield _episode(entry)


def _episode(entry: dict[str, Any]) -> str:
    seconds, rest = divmod(int(entry["__REALTIME_TIMESTAMP"]), _MICROSECONDS)
    when = datetime.fromtimestamp(seconds).astimezone().replace(microsecond=rest)
    period, late, missed, cause = (entry[field] for field in _FIELDS)
    return (
        f"{when:%Y-%m-%d %H:%M:%S.%f}  {entry.get('MODEL', '-'):24} "
        f"{period:>9} {late:>9} {missed:>6}  {cause}"
    )
