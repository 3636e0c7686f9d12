"""What accounting costs: time, memory, growth, and how long a start takes.

    firmware-runtime bench accounting [--only start|memory|growth|cold|cost] [--json] [--save]

Start and memory are the command's, in processes of its own; the rest steps the executive here.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.accounting import cold, cost, growth, memory, start
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.process import make_byte_code
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.status import Status

SUMMARY = "What accounting costs a step, in memory and at the start; whether memory grows."
_SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 -- files in it get unguessable names
TEXTS: dict[str, Callable[[dict[str, Any]], list[str]]] = {
    "start": start.text,
    "memory": memory.text,
    "growth": growth.text,
    "cold": cold.text,
    "cost": cost.text,
}
"""How each part's result reads; parts are measured in this order."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument(
        "--only", choices=TEXTS, action="append", help="this part; may be repeated; default all"
    )
    parser.add_argument(
        "--repetitions", type=positive, default=7, metavar="N", help="of each figure of time"
    )
    parser.add_argument(
        "--activations", type=positive, default=20_000, metavar="N", help="in each round of steps"
    )
    parser.add_argument(
        "--cold-steps", type=positive, default=50, metavar="N", help="in each round at 100 Hz"
    )
    parser.add_argument(
        "--ticks", type=positive, default=100_000, metavar="N", help="over which memory may grow"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure what was chosen; print each part with its ratio, the cost of a step last."""
    report: dict[str, Any] = {"conditions": conditions()}
    shared = _SHARED_MEMORY if os.access(_SHARED_MEMORY, os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="accounting-", dir=shared) as directory:
        for part in TEXTS:
            if arguments.only is None or part in arguments.only:
                print(f"bench accounting: {part}", file=sys.stderr)
                report[part] = _measure(part, Path(directory), arguments)
    report["ratio"] = report[list(report)[-1]]["ratio"]  # of the last part, as in the text
    save(arguments.save, "accounting", report)
    print(json.dumps(report) if arguments.json else _text(report))
    return Status.OK


def _measure(part: str, directory: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    if part == "growth":
        return growth.measure(directory, arguments.ticks)
    if part == "cold":
        return cold.measure(directory, arguments.repetitions, arguments.cold_steps)
    if part == "cost":
        return cost.measure(directory, arguments.repetitions, arguments.activations)
    make_byte_code(directory)
    if part == "memory":
        return memory.measure(directory)
    return start.measure(directory, arguments.repetitions)


def _text(report: dict[str, Any]) -> str:
    parts = ["\n".join(text(report[part])) for part, text in TEXTS.items() if part in report]
    return "\n\n".join([conditions_text(report["conditions"]), *parts])
