"""A flood of datagrams at the robot's end of a link: whether its loop notices.

    firmware-runtime bench flood [--rate N] [--seconds S] [--rounds N]

One run of TachoBot's robot end on doubles, its controller at the other end of a link over UDP with
a key. In turns it is left alone and flooded with datagrams that no key has signed. Overruns and
lateness of both kinds of spans are printed side by side.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import sleep
from typing import Any

from benchmarks.flood.ends import HOST, Ends, both_ends
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import PROJECT, positive
from firmware_runtime.statistics.comparison import difference
from firmware_runtime.status import Status

SUMMARY = "A flood of hostile datagrams at the robot's end of a link: whether its loop notices."
QUIET, FLOODED = "alone", "flooded"
_COLUMNS = (
    "scheduled",
    "overruns",
    "skipped",
    "coalesced",
    "p50_us",
    "p99_us",
    "max_us",
    "sent",
    "armed",
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--rate", type=positive, default=20_000, help="datagrams a second")
    parser.add_argument("--seconds", type=positive, default=10, help="of each span")
    parser.add_argument("--rounds", type=positive, default=3, help="spans of each kind")


def execute(arguments: argparse.Namespace) -> int:
    """Run, flood, print; the comparison comes last."""
    spans: list[dict[str, Any]] = []
    with (
        tempfile.TemporaryDirectory(prefix="flood-") as directory,
        both_ends(Path(directory)) as ends,
    ):
        ends.wait_until_armed()
        sleep(1.0)  # the start is no part of either
        for _ in range(arguments.rounds):
            spans += [_span(ends, kind, arguments) for kind in (QUIET, FLOODED)]
        link = ends.ended().get("link")
    report = {"conditions": conditions(), "spans": spans, "link": link, "total": _totals(spans)}
    print(json.dumps(report) if arguments.json else _text(report))
    save(arguments.save, "flood", report)
    return Status.OK


def _span(ends: Ends, kind: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """One span; the process that floods is there in both, and sends nothing in one."""
    before = ends.read()
    rate = arguments.rate if kind == FLOODED else 0
    words = map(str, (HOST, ends.port, rate, arguments.seconds))
    printed = subprocess.run(
        [sys.executable, "-m", "benchmarks.flood.flooder", *words],
        cwd=PROJECT,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    figures = difference(ends.read(), before).figures()
    lateness = figures.models["imu"].lateness_us
    return {
        "kind": kind,
        "scheduled": figures.scheduled,
        "overruns": figures.overruns,
        "skipped": figures.skipped,
        "coalesced": figures.coalesced,
        "p50_us": lateness.p50,
        "p99_us": lateness.p99,
        "max_us": lateness.max,
        "sent": json.loads(printed)["sent"],
        "armed": ends.is_armed,
    }


def _totals(spans: Sequence[dict[str, Any]]) -> dict[str, dict[str, int]]:
    counted = ("scheduled", "overruns", "skipped", "coalesced", "sent")
    return {
        kind: {name: sum(span[name] for span in spans if span["kind"] == kind) for name in counted}
        for kind in (QUIET, FLOODED)
    }


def _text(report: dict[str, Any]) -> str:
    lines = [conditions_text(report["conditions"]), ""]
    lines.append(f"{'':8}" + "".join(f"{name:>11}" for name in _COLUMNS))
    for span in report["spans"]:
        cells = "".join(f"{_cell(span[name]):>11}" for name in _COLUMNS)
        lines.append(f"{span['kind']:8}{cells}")
    total = report["total"]
    lines += ["", f"the link's own count: {json.dumps(report['link'])}"]
    shares = {
        kind: f"{total[kind]['overruns']} overruns of {total[kind]['scheduled']} activations"
        for kind in total
    }
    return "\n".join([*lines, f"alone {shares[QUIET]}, flooded {shares[FLOODED]}"])


def _cell(value: object) -> str:
    return f"{value:.0f}" if isinstance(value, float) else str(value)
