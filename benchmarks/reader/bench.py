"""Whether a reader of the statistics disturbs the loop: TachoBot with and without one at 10 Hz.

    firmware-runtime bench reader [--of statistics|page] [--rates 100,999] [--rounds N]
                                  [--segment S] [--json] [--save]

With `--of page` it is a page's process with eight viewers of twenty curves each, in its place.

How sure a ratio is stands beside it, and so does a control without a reader on either side.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.loop.bench import rates
from benchmarks.reader.ratio import GOAL, summary
from benchmarks.reader.rounds import rounds
from benchmarks.shared.results import (
    conditions,
    finish,
    positive,
)
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status

SUMMARY = "The loop's lateness with and without a reader of its statistics."
RATES = (100, 999)
MODULES = {"statistics": "process", "page": "viewers"}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--rates", type=rates, default=RATES, metavar="HZ,...", help="default 100,999"
    )
    parser.add_argument(
        "--of", choices=MODULES, default="statistics", help="what is read; default statistics"
    )
    parser.add_argument(
        "--rounds", type=positive, default=30, metavar="N", help="at each rate; three segments each"
    )
    parser.add_argument(
        "--segment", type=positive_number, default=2.0, metavar="S", help="seconds of one segment"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure at every rate; the ratio farthest from 1 comes last."""
    report: dict[str, Any] = {"conditions": conditions(), "goal": GOAL, "rates": []}
    for rate_hz in arguments.rates:
        print(
            f"bench reader: {rate_hz} Hz, {arguments.rounds} rounds of 3 times "
            f"{arguments.segment:g} s",
            file=sys.stderr,
        )
        with tempfile.TemporaryDirectory(prefix="reader-") as directory:
            found, readings = rounds(
                Path(directory),
                rate_hz,
                arguments.rounds,
                arguments.segment,
                MODULES[arguments.of],
            )
        report["rates"].append({"rate_hz": rate_hz, "readings": readings, **summary(found)})
    report["ratio"] = max((each["ratio"] for each in report["rates"]), key=_distance)
    finish(arguments, "reader", report, _lines)
    return Status.OK


def _distance(ratio: float) -> float:
    """How far a ratio is from 1, whichever side it is on."""
    return max(ratio, 1 / ratio)


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    for each in report["rates"]:
        yield f"\n{each['rate_hz']} Hz, lateness in us; {each['readings']} readings or frames:"
        yield f"  {'':14}{'samples':>10}{'p50':>10}{'p99':>10}{'p99.9':>10}"
        for kind, us in each["us"].items():
            cells = "".join(f"{us[name]:10.1f}" for name in ("p50", "p99", "p999"))
            yield f"  {kind:14}{each['samples'][kind]:10}{cells}"
        yield f"  {_interval(each['control'])}, both alone: the control"
        yield f"  {_verdict(each)}"
        yield f"ratio {_interval(each)}, p99 read by p99 alone at {each['rate_hz']} Hz"
    yield f"ratio {report['ratio']:.2f} (the farthest from 1)"


def _interval(ratio: dict[str, Any]) -> str:
    return f"{ratio['ratio']:.2f} ({ratio['low']:.2f} to {ratio['high']:.2f} with 95 %)"


def _verdict(found: dict[str, Any]) -> str:
    goal = f"a change of less than {GOAL:.0%}"
    return f"shown: {goal}" if found["shown"] else f"not shown: {goal}; more rounds say more"
