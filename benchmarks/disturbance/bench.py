"""What befalls a robot's end of a link, and whether its loop notices.

    firmware-runtime bench disturbance [--rate N] [--seconds S] [--rounds N]

One run of TachoBot's robot end on doubles, its controller at the other end of a link over UDP with
a key. In turns it is left alone, flooded with datagrams that no key has signed, and its controller
is killed and started again every second or so. Overruns and lateness are printed side by side. The
process that floods is there in every span, and sends nothing in the others.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from random import Random
from statistics import median
from time import sleep
from typing import Any

from benchmarks.disturbance.ends import HOST, Ends, both_ends
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import PROJECT, positive
from firmware_runtime.statistics.comparison import difference
from firmware_runtime.status import Status

SUMMARY = (
    "A flood at the robot's end of a link, and kill -9 of its controller: does its loop notice?"
)
KINDS = ALONE, FLOODED, KILLED = "alone", "flooded", "killed"
_COLUMNS = (
    "scheduled",
    "overruns",
    "skipped",
    "coalesced",
    "p50_us",
    "p99_us",
    "max_us",
    "sent",
    "kills",
    "armed",
)
_RANDOM = Random(1)  # noqa: S311 -- when to kill is to be repeated


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
        tempfile.TemporaryDirectory(prefix="disturbance-") as directory,
        both_ends(Path(directory)) as ends,
    ):
        ends.wait_until_armed()
        sleep(1.0)  # the start is no part of either
        for _ in range(arguments.rounds):
            spans += [_span(ends, kind, arguments) for kind in KINDS]
            ends.wait_until_armed()
        link = ends.ended().get("link")
    report = {"conditions": conditions(), "spans": spans, "link": link, "total": _totals(spans)}
    print(json.dumps(report) if arguments.json else _text(report))
    save(arguments.save, "disturbance", report)
    return Status.OK


def _span(ends: Ends, kind: str, arguments: argparse.Namespace) -> dict[str, Any]:
    before = ends.read()
    rate = arguments.rate if kind == FLOODED else 0
    words = map(str, (HOST, ends.port, rate, arguments.seconds))
    kills = 0
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.disturbance.flooder", *words],
        cwd=PROJECT,
        stdout=subprocess.PIPE,
        text=True,
    ) as flooder:
        while kind == KILLED and flooder.poll() is None:
            ends.kill_controller()
            kills += 1
            sleep(_RANDOM.uniform(0.5, 2.0))
        printed = flooder.communicate()[0]
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
        "kills": kills,
        "armed": ends.is_armed,
    }


def _totals(spans: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    counted = ("scheduled", "overruns", "skipped", "coalesced", "sent", "kills")
    totals: dict[str, dict[str, float]] = {}
    for kind in KINDS:
        own = [span for span in spans if span["kind"] == kind]
        totals[kind] = {name: sum(span[name] for span in own) for name in counted}
        totals[kind]["p99_us"] = median(span["p99_us"] for span in own)
    return totals


def _text(report: dict[str, Any]) -> str:
    lines = [conditions_text(report["conditions"]), ""]
    lines.append(f"{'':8}" + "".join(f"{name:>11}" for name in _COLUMNS))
    for span in report["spans"]:
        cells = "".join(f"{_cell(span[name]):>11}" for name in _COLUMNS)
        lines.append(f"{span['kind']:8}{cells}")
    total = report["total"]
    lines += ["", f"the link's own count: {json.dumps(report['link'])}"]
    for kind, each in total.items():
        ratio = each["p99_us"] / total[ALONE]["p99_us"]
        lines.append(
            f"{kind:8} {each['overruns']:.0f} overruns of {each['scheduled']:.0f}, median of p99 "
            f"{each['p99_us']:.0f} us, {ratio:.2f} of that alone"
        )
    return "\n".join(lines)


def _cell(value: object) -> str:
    return f"{value:.0f}" if isinstance(value, float) else str(value)
