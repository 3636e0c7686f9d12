"""Whether the named cause of a late activation is the right one: ten causes, injected.

    firmware-runtime bench blame [--times N] [--only CAUSE] [--seed N] [--json] [--save]

Each cause is injected so many times into a run of its own, a model of 100 Hz in real time, and what
the run's statistics then name is counted: the right cause, another, or "unknown". What cannot be
injected here is "not run", with the reason.
"""

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from benchmarks.blame.causes import INJECTED
from benchmarks.blame.quota import NoQuotaError
from benchmarks.blame.text import report_text
from benchmarks.blame.trial import Trial, TrialError, processors
from benchmarks.shared.conditions import conditions
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.blame import Cause
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.status import Status

SUMMARY = "Whether the named cause of a late activation is the right one: ten causes, injected."
WANTED = 0.95
NOT_LATE = "not late"
"""Of an injection that made nothing late: the machine was quicker than it."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--times", type=positive, default=50, metavar="N", help="each cause")
    parser.add_argument(
        "--only", choices=INJECTED, action="append", help="this cause; may be repeated; default all"
    )
    parser.add_argument("--seed", type=int, default=14, metavar="N", help="of spans and phases")
    parser.add_argument(
        "--disk",
        type=Path,
        metavar="FOLDER",
        help="on the disk that is waited for; default: the folder of temporary files",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Inject what was chosen; print the table, and the least share of right ones last."""
    rows: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="blame-", dir=arguments.disk) as folder:
        for cause in arguments.only or INJECTED:
            print(f"bench blame: {cause}: {INJECTED[cause].about}", file=sys.stderr)
            rows[cause] = _row(cause, arguments, Path(folder))
    report = {"conditions": conditions(), "times": arguments.times, "causes": rows, **_sums(rows)}
    save(arguments.save, "blame", report)
    print(json.dumps(report) if arguments.json else report_text(report))
    return Status.OK if report["as_wanted"] else Status.MODEL_ERROR


def _row(cause: str, arguments: argparse.Namespace, folder: Path) -> dict[str, Any]:
    try:
        found = Trial(cause, arguments.times, arguments.seed, processors(), folder).run()
    except (NoQuotaError, PermissionError, TrialError) as error:
        return {"not_run": str(error)}
    return judged(cause, found)


def judged(cause: str, found: Sequence[WorstActivation | None]) -> dict[str, Any]:
    """How many were right, wrong and unknown, of those that made something late."""
    named = Counter(_name(each) for each in found)
    late = len(found) - named[NOT_LATE]
    right, unknown = named[INJECTED[cause].right], named[Cause.UNKNOWN]
    as_it_should = {INJECTED[cause].right, NOT_LATE}
    return {
        "named": dict(named),
        "late": late,
        "right": right,
        "unknown": unknown,
        "wrong": late - right - unknown,
        "share": right / late if late > 0 else None,
        "not_right": [
            {"t_s": each.t_ns / SECOND, **to_builtins(each.blame)}
            for each in found
            if each is not None and _name(each) not in as_it_should
        ],
    }


def _name(found: WorstActivation | None) -> str:
    return NOT_LATE if found is None or found.blame is None else found.blame.cause


def _sums(rows: Mapping[str, Any]) -> dict[str, Any]:
    shares = [row["share"] for row in rows.values() if row.get("share") is not None]
    least = min(shares, default=None)
    wrong = sum(row.get("wrong", 0) for row in rows.values())
    as_wanted = bool(least and least >= WANTED)
    return {"wanted": WANTED, "least_share": least, "wrong": wrong, "as_wanted": as_wanted}
