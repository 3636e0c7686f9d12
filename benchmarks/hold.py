"""The hold model, side by side with xdevs.py: `python -m benchmarks.hold [--json]`.

N uncoupled atomics that only wait, with equal or with distinct periods: what it costs to find out
who is next. CPU time, set-up included, medians over runs in fresh processes that take turns; both
engines' transitions are checked against the arithmetic. Prints microseconds a transition and, last,
the ratios: how many times as much CPU time xdevs.py takes.

Exit status 1 if an engine did not do the work, 2 if xdevs.py is not installed.
"""

import argparse
import json
import sys
from typing import Any

from benchmarks.hold_plan import KINDS, transitions
from benchmarks.side_by_side import (
    OURS,
    PEER,
    WrongCountError,
    check_counts,
    conditions,
    conditions_text,
    in_turns,
    medians,
    missing_peer,
    peer_version,
    positive,
)

COUNTS = (1, 50, 200)
MODULES = ("benchmarks.hold_ours", "benchmarks.hold_xdevs")


def main() -> int:
    """Measure every kind and number; return the exit status."""
    arguments = _arguments()
    if peer_version() is None:
        print(missing_peer(), file=sys.stderr)
        return 2
    found = conditions()
    try:
        results = [
            measure(kind, count, arguments.repetitions) for kind in KINDS for count in COUNTS
        ]
    except WrongCountError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 1
    report = {
        "conditions": found,
        "models": results,
        "ratio": min(result["ratio"] for result in results),
    }
    print(json.dumps(report) if arguments.json else _text(report, arguments.repetitions))
    return 0


def measure(kind: str, count: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    expected = {"internal": transitions(kind, count)}
    ours, peers = in_turns(MODULES, repetitions, kind, count)
    for who, samples in ((OURS, ours), (PEER, peers)):
        for sample in samples:
            check_counts(f"{who}, {count} with {kind} periods,", sample, expected)
    seconds = {OURS: medians(ours), PEER: medians(peers)}
    return {
        "periods": kind,
        "atomics": count,
        "seconds": seconds,
        "transitions": expected["internal"],
        "ratio": seconds[PEER]["total"] / seconds[OURS]["total"],
    }


def _text(report: dict[str, Any], repetitions: int) -> str:
    lines = [
        f"Hold model: microseconds of CPU time a transition, medians of {repetitions} runs each",
        conditions_text(report["conditions"]),
        "",
        f"{'periods':10}{'atomics':>8}{'transitions':>13}{OURS:>18}{PEER:>10}",
    ]
    for each in report["models"]:
        ours, peer = (
            each["seconds"][engine]["total"] / each["transitions"] * 1e6 for engine in (OURS, PEER)
        )
        lines.append(
            f"{each['periods']:10}{each['atomics']:8}{each['transitions']:13}{ours:18.2f}{peer:10.2f}"
        )
    lines.append("")
    lines += [
        f"ratio {each['atomics']} {each['periods']} {each['ratio']:.1f}"
        for each in report["models"]
    ]
    lines.append(f"ratio {report['ratio']:.1f} (the least)")
    return "\n".join(lines)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hold", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--repetitions", type=positive, default=5, help="runs of each engine")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
