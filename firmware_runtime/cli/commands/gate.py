"""`firmware-runtime gate BASE HEAD BOARD`: is HEAD slower? Decided on pairs, or undecided."""

import argparse
import os
import sys

from msgspec import json, to_builtins

from firmware_runtime.cli.arguments import SubParsers, add_verb, positive
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.gate.checkouts import Checkout, checkouts
from firmware_runtime.lab.gate.decision import (
    ERROR,
    FEWEST_PAIRS,
    MOST_PAIRS,
    Verdict,
)
from firmware_runtime.lab.gate.gate import Outcome, gate_lines, pass_gate
from firmware_runtime.lab.gate.pairs import measured_pairs
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.signals import exit_on_signals
from firmware_runtime.system.terminal import Progress
from firmware_runtime.system.whole_numbers import whole_number

PAIRS = 48
TOLERANCE_PERCENT = 10.0
_STATUSES = {
    Verdict.NO_SLOWER: Status.OK,
    Verdict.SLOWER: Status.MODEL_ERROR,
    Verdict.CANNOT_TELL: Status.CANNOT_TELL,
}
_ABOUT = f"""
BASE and HEAD are folders, or revisions of the git repository here. A board runs on its doubles, a
model alone, in virtual time, both versions at once on one processor; what is compared is processor
time. Behind `--` a command may stand instead, which is run in either folder. With a chance of
{ERROR:.0%} at most `slower` is said of what is within the tolerance, and likewise `no slower` of
what is not.
Exit status: 0 no slower, 1 slower, 11 cannot tell here, 2 bad input. docs/performance.md.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = (
        "Say whether HEAD takes more processor time than BASE, or that this machine cannot tell."
    )
    verb = add_verb(verbs, "gate", summary, execute)
    verb.epilog = _ABOUT
    verb.usage = f"{verb.prog} [options] BASE HEAD (BOARD | MODULE:CLASS | -- COMMAND ...)"
    verb.set_defaults(parser=verb)
    verb.add_argument(
        "compared",  # all of it: argparse would lose the `--`
        metavar="BASE HEAD BOARD",
        nargs=argparse.REMAINDER,
        help="two folders or revisions of git, and a board's name or file, a model's class, or -- "
        "and a command",
    )
    _add_options(verb)


def _add_options(parser: argparse.ArgumentParser) -> None:
    """Options, which may stand before BASE or after the board. Unset ones are left out."""
    parser.argument_default = argparse.SUPPRESS
    parser.add_argument(
        "--pairs",
        type=_pairs,
        metavar="N",
        help=f"at most, {FEWEST_PAIRS} to {MOST_PAIRS}; default {PAIRS}; it looks after a quarter, "
        "a half and all of them",
    )
    parser.add_argument(
        "--tolerance",
        type=positive,
        metavar="PERCENT",
        help=f"how much more is not slower yet; default {TOLERANCE_PERCENT:g}",
    )
    parser.add_argument(
        "--seed", type=int, metavar="S", help="chooses who is first in each pair; default 0"
    )
    parser.add_argument(
        "--set",
        action="append",
        metavar="KEY=VALUE",
        dest="assignments",
        help="override one number of board.toml, in both versions; may be repeated",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _pairs(text: str) -> int:
    number = whole_number(text, MOST_PAIRS)
    if number is None or number < FEWEST_PAIRS:
        expected = f"expected a whole number from {FEWEST_PAIRS}, which can decide, to {MOST_PAIRS}"
        raise argparse.ArgumentTypeError(f"{text!r}: {expected}")
    return number


def execute(arguments: argparse.Namespace) -> int:
    """Measure, decide, print."""
    verb: argparse.ArgumentParser = arguments.parser
    words, command = _split(arguments.compared)
    if {"-h", "--help"} & set(words):
        verb.print_help()
        return Status.OK
    chosen = _chosen(words, arguments, verb)
    _check(chosen, command)
    with exit_on_signals(), own_folder() as folder, Progress(sys.stderr) as progress:
        versions = checkouts(chosen.base, chosen.head, folder)
        outcome = _passed(versions, command, chosen, progress)
    _print(outcome, versions, as_json=getattr(chosen, "json", False))
    return _STATUSES[outcome.decision.verdict]


def _split(words: list[str]) -> tuple[list[str], list[str] | None]:
    """What stands before `--`, and the command after it; None without."""
    if "--" not in words:
        return words, None
    at = words.index("--")
    return words[:at], words[at + 1 :]


def _chosen(
    words: list[str], arguments: argparse.Namespace, verb: argparse.ArgumentParser
) -> argparse.Namespace:
    """BASE, HEAD, the board and all options, also those that stand behind it."""
    parser = type(verb)(prog=verb.prog, usage=verb.usage, add_help=False)
    for name in ("base", "head"):
        parser.add_argument(name, metavar=name.upper())
    parser.add_argument("board", nargs="?", default=None)
    _add_options(parser)
    return parser.parse_intermixed_args(words, argparse.Namespace(**vars(arguments)))


def _check(chosen: argparse.Namespace, command: list[str] | None) -> None:
    if (chosen.board is None) == (command is None) or command == []:
        both = "both a board and a command" if chosen.board and command else "no board, no command"
        expected = "expected BOARD, MODULE:CLASS, or -- and a command"
        raise ConfigError.of_one("gate", f"{both}; {expected}")
    if command and hasattr(chosen, "assignments"):
        raise ConfigError.of_one("gate", "--set changes a board", expected="no command with it")


def _passed(
    versions: tuple[Checkout, Checkout],
    command: list[str] | None,
    chosen: argparse.Namespace,
    progress: Progress,
) -> Outcome:
    words = [chosen.board, *getattr(chosen, "assignments", [])]
    cost_of = "1 s of robot time"
    if command is not None:
        words, cost_of = ["--", *command], "a run of the command"
    pairs = measured_pairs(versions, words, getattr(chosen, "seed", 0))
    tolerance = getattr(chosen, "tolerance", TOLERANCE_PERCENT) / 100

    def shown(count: int, most: int) -> None:
        progress.show(f"gate: {count} pairs of {most} at most")

    return pass_gate(pairs, cost_of, tolerance, getattr(chosen, "pairs", PAIRS), shown)


def _print(outcome: Outcome, versions: tuple[Checkout, Checkout], *, as_json: bool) -> None:
    if as_json:
        figures = to_builtins(outcome)
        named = {
            each.name.lower(): {"stated": each.stated, "commit": each.commit} for each in versions
        }
        print(json.encode({**figures.pop("decision"), **figures, **named}).decode())
        return
    first, *rest = gate_lines(outcome, versions)
    forced = bool(os.environ.get("FORCE_COLOR"))
    in_colour = forced or (sys.stdout.isatty() and not os.environ.get("NO_COLOR"))
    if in_colour and outcome.decision.verdict is not Verdict.NO_SLOWER:
        first = f"\x1b[1;31m{first}\x1b[0m"
    print("\n".join([first, *rest]))
