"""`firmware-runtime safe-state BOARD`: write full-off to every chip, and nothing else."""

import argparse
import sys
from time import monotonic_ns

import boards.registry
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.guard import add_doubles
from firmware_runtime.cli.outputs import Outputs
from firmware_runtime.cli.readers_gone import readers_may_go
from firmware_runtime.cli.status import Status
from firmware_runtime.cli.until_signal import until_signal
from firmware_runtime.devs.time import MILLISECOND, SECOND

PATIENCE = 2 * SECOND
"""Ns in which it is tried again: a stuck bus may come free; systemd waits for longer."""
BETWEEN = 20 * MILLISECOND


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Switch every output of a board full-off, whoever drives it."
    verb = add_verb(verbs, "safe-state", summary, execute)
    add_board(verb)
    add_doubles(verb)
    verb.add_argument(
        "--reason", default="asked for", help="why, for the journal; systemd's $SERVICE_RESULT"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write until all chips have acknowledged, at most for two seconds.

    A signal ends the trying again, but never between two chips.
    """
    board = boards.registry.load(arguments.board, arguments.assignments)
    outputs = Outputs(board, arguments.doubles)
    give_up_at = monotonic_ns() + PATIENCE
    with until_signal() as signal:
        failed = outputs.make_safe()
        while failed and monotonic_ns() < give_up_at and not signal.wait(BETWEEN / SECOND):
            failed = outputs.make_safe()
    outputs.close()
    with readers_may_go():
        for failure in failed:
            print(f"firmware-runtime: not made safe: {failure}", file=sys.stderr)
        if not failed:
            print(f"{board.name}: all outputs off ({arguments.reason})")
    return Status.NOT_SAFE if failed else Status.OK
