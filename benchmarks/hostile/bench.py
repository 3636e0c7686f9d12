"""Datagrams that should not be obeyed: how many are, by what enters and by exact counts.

firmware-runtime bench hostile [--datagrams N] [--seed N]
"""

import argparse
from time import perf_counter

from benchmarks.hostile.bridge import BridgeTarget
from benchmarks.hostile.link import LinkTarget
from benchmarks.hostile.sweep import result_text, sweep
from benchmarks.shared.side_by_side import positive
from firmware_runtime.status import Status

SUMMARY = "Seeded hostile datagrams against what judges them, beside an independent judge."


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument("--datagrams", type=positive, default=1_000_000, metavar="N")
    parser.add_argument("--seed", type=positive, default=1, metavar="N")


def execute(arguments: argparse.Namespace) -> int:
    """Sweep each target; fail unless all are clean."""
    clean = True
    for target in (LinkTarget(arguments.seed), BridgeTarget(arguments.seed)):
        began = perf_counter()
        result = sweep(target, arguments.datagrams)
        print(result_text(target.name, result))
        print(f"{perf_counter() - began:.0f} s\n")
        clean &= result.is_clean
    return Status.OK if clean else Status.MODEL_ERROR
