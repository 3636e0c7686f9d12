"""`firmware-runtime service health BOARD`: whether an installed robot is healthy."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_verb, positive
from firmware_runtime.cli.service_status import add_board_name, demand_known
from firmware_runtime.errors import StatisticsFileError, Status
from firmware_runtime.host.installation.health import complaints, not_compared, observed
from firmware_runtime.host.installation.target import target
from firmware_runtime.statistics.figures import Figures, figures_of
from firmware_runtime.statistics.summary import summary

_ABOUT = """
It must begin within a minute and run for the seconds asked, with few faults, each model with a
period due half as often as that says, at least. Beside figures from before, as `stats --json`
prints them, models must be due as often as they were, within the same half, faults come and
activations be late no more often, and steps be no longer. Exit status: 0 if it is healthy, 6 if it
does not run, 8 if not.
"""


def add_health_to(actions: SubParsers) -> None:
    """Add this action to the verb."""
    about = "Watch an installed robot for a while and say whether it is healthy."
    verb = add_verb(actions, "health", about, _execute)
    verb.epilog = _ABOUT
    add_board_name(verb)
    verb.add_argument(
        "--for",
        type=positive,
        default=30.0,
        dest="seconds",
        metavar="SECONDS",
        help="how long; default 30",
    )
    verb.add_argument(
        "--before", type=Path, metavar="FILE", help="figures to compare with; none if not there"
    )


def _execute(arguments: argparse.Namespace) -> int:
    demand_known(arguments.board, target(None, dry_run=True))
    before = _figures_in(arguments.before)
    try:
        trial = observed(arguments.board, arguments.seconds)
    except StatisticsFileError as error:
        print(f"firmware-runtime: {error}", file=sys.stderr)
        return Status.NOTHING_HAPPENED
    if wrong := "; ".join(complaints(trial, before)):
        print(f"firmware-runtime: {wrong}", file=sys.stderr)
        return Status.DOCTOR_FAILS
    why = None if before is None else not_compared(trial.whole, before)
    print(f"healthy for {arguments.seconds:g} s: {summary(trial.whole)}{f'; {why}' if why else ''}")
    return Status.OK


def _figures_in(file: Path | None) -> Figures | None:
    if file is None or not file.exists():
        return None
    try:
        return figures_of(file.read_bytes(), str(file))
    except StatisticsFileError as error:  # of a version whose figures are others
        print(f"firmware-runtime: not compared with {error}", file=sys.stderr)
        return None
