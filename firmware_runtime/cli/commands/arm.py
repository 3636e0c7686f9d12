"""`firmware-runtime arm [BOARD]`, `disarm [BOARD]`: let a run drive its outputs, or stop that."""

import argparse
import sys

from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.links.control import ask
from firmware_runtime.statistics.paths import find_statistics


def add_to(verbs: SubParsers) -> None:
    """Add both verbs to the command line."""
    for name, summary in (
        ("arm", "Let a run drive its outputs, unless something speaks against it."),
        ("disarm", "Make a run's outputs safe and keep them so; it runs on."),
    ):
        verb = add_verb(verbs, name, summary, execute)
        verb.add_argument(
            "board", metavar="BOARD", nargs="?", help="a board's name; default: whatever ran last"
        )
        add_statistics(verb, "of the run that keeps this file")
        verb.set_defaults(request=name)


def execute(arguments: argparse.Namespace) -> int:
    """Ask, and print the answer; ControlError says why there is none."""
    statistics = arguments.statistics or find_statistics(arguments.board)
    answer = ask(statistics, arguments.request)
    for reason in answer.get("refused", ()):
        print(f"firmware-runtime: {arguments.request} refused: {reason}", file=sys.stderr)
    for failure in answer.get("not_safe", ()):
        print(f"firmware-runtime: not made safe: {failure}", file=sys.stderr)
    if answer.get("not_safe"):
        return Status.NOT_SAFE
    if answer.get("refused"):
        return Status.REFUSED
    print("armed" if answer["armed"] else "disarmed")
    return Status.OK
