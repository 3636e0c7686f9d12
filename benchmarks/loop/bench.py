"""How fast TachoBot can run on its doubles, and where the time of its steps goes.

    firmware-runtime bench loop [--rates 50,100,200,500,999] [--activations N] [--json] [--save]

The highest rate is searched with the command as shipped, in processes of its own; the time is split
in this one. An activation counts as late when it began later than a tenth of its period, or was
dropped. A robot has no doubles: what they take is reported apart, and what the wire takes instead
is computed from bits and bus speed.
"""

import argparse
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.loop.rates import HIGHEST_HZ, LOWEST_HZ, highest, run
from benchmarks.loop.split import BUS, split
from benchmarks.loop.text import loop_lines
from benchmarks.shared.results import conditions, finish, positive
from firmware_runtime.board import registry
from firmware_runtime.errors import Status
from firmware_runtime.hal.budget import REFUSED_ABOVE_PERCENT, BusLoad, transaction_ns

SUMMARY = "The highest rate of TachoBot on its doubles, and where the time of a step goes."
RATES = (50, 100, 200, 500, 999)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--rates", type=rates, default=RATES, metavar="HZ,...", help="default 50,100,200,500,999"
    )
    parser.add_argument(
        "--activations",
        type=positive,
        default=10_000,
        metavar="N",
        help="at each rate tried; fewer show less, and the report says how much",
    )
    parser.add_argument(
        "--refinements", type=positive, default=2, metavar="N", help="rates tried between two"
    )
    parser.add_argument(
        "--split-seconds", type=positive, default=3, metavar="S", help="of each split run"
    )
    parser.add_argument("--repetitions", type=positive, default=3, help="of each split run")


def rates(text: str) -> tuple[int, ...]:
    """Rates of the command line, in Hz."""
    found = tuple(positive(each) for each in text.split(","))
    for rate_hz in found:
        if not LOWEST_HZ <= rate_hz <= HIGHEST_HZ:
            raise argparse.ArgumentTypeError(
                f"{rate_hz} Hz: expected {LOWEST_HZ} to {HIGHEST_HZ}, as TachoBot's board takes"
            )
    return found


def execute(arguments: argparse.Namespace) -> int:
    """Split, search, print; the ratio comes last."""
    board = registry.load("tachobot")
    own_hz = round(1 / board.settings.controller.period_s)
    report: dict[str, Any] = {
        "conditions": conditions(),
        "split": _splits(arguments),
        "wire": wire(board.loads[BUS]),
    }
    with tempfile.TemporaryDirectory(prefix="loop-") as directory:

        def measure(rate_hz: int) -> dict[str, Any]:
            _log(f"{rate_hz} Hz, {arguments.activations} activations")
            return run(Path(directory), rate_hz, arguments.activations)

        report["rates"] = highest(arguments.rates, measure, arguments.refinements)
    held = [each["rate_hz"] for each in report["rates"] if each["holds"]]
    report["highest_hz"] = max(held, default=None)
    ours = [each["rate_hz"] for each in report["rates"] if each["late_by_us"] == 0]
    report["highest_hz_by_us"] = max(ours, default=None)
    report["own_hz"] = own_hz
    report["ratio"] = max(held, default=0) / own_hz
    finish(arguments, "loop", report, loop_lines)
    return Status.OK


def wire(load: BusLoad) -> dict[str, float]:
    """What a tick's transactions take on the wire, and what rate that allows: all computed."""
    tick_ns = sum(
        transaction_ns(each.messages, load.bus_hz, load.overhead_ns) for each in load.transactions
    )
    return {
        "bus_hz": load.bus_hz,
        "us": tick_ns / 1000,
        "full_at_hz": 1e9 / tick_ns,
        "refused_above_hz": 1e7 * REFUSED_ABOVE_PERCENT / tick_ns,
    }


def _splits(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """The rates take turns."""
    rounds = []
    for number in range(arguments.repetitions):
        _log(f"where the time goes, round {number + 1} of {arguments.repetitions}")
        rounds.append([split(rate_hz, arguments.split_seconds) for rate_hz in arguments.rates])
    return [medians(runs) for runs in zip(*rounds, strict=True)]


def medians(runs: tuple[dict[str, Any], ...]) -> dict[str, Any]:
    """The medians of several splits at one rate."""
    return {
        "rate_hz": runs[0]["rate_hz"],
        "busy": median(each["busy"] for each in runs),
        "us": {label: median(each["us"][label] for each in runs) for label in runs[0]["us"]},
        "kinds_us": {
            kind: median(each["kinds_us"][kind] for each in runs) for kind in runs[0]["kinds_us"]
        },
    }


def _log(progress: str) -> None:
    print(f"bench loop: {progress}", file=sys.stderr)
