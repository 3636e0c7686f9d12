"""`firmware-runtime stats [BOARD]`: read a run's statistics, while it runs or after it died."""

import argparse
import json
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.statistics_text import statistics_text
from firmware_runtime.cli.status import Status
from firmware_runtime.telemetry.paths import find_statistics
from firmware_runtime.telemetry.statistics_reader import read_statistics


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Show the statistics of the run under way, or of the last; reading changes nothing."
    verb = add_verb(verbs, "stats", summary, execute)
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", help="a board's name; default: whatever ran last"
    )
    verb.add_argument("--statistics", type=Path, metavar="FILE", help="read this file instead")
    verb.add_argument("--json", action="store_true", help="print them as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Print the statistics; StatisticsFileError says why there are none."""
    statistics = read_statistics(arguments.statistics or find_statistics(arguments.board)).as_json()
    if arguments.json:
        print(json.dumps(statistics, allow_nan=False))
    else:
        print("\n".join(statistics_text(statistics)))
    return Status.OK
