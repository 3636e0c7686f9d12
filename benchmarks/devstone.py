"""DEVStone, side by side with xdevs.py: `python -m benchmarks.devstone [--json]`.

CPU seconds of each engine, set-up included and shown apart, medians over runs in fresh processes
that take turns. Both engines' transitions are checked against the published formulas. Prints
seconds, transitions and, last, the ratios: how many times as much CPU time xdevs.py takes.

Exit status 1 if an engine did not do the work, 2 if xdevs.py is not installed.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.devstone_counts import transitions
from benchmarks.devstone_models import SHAPES
from benchmarks.side_by_side import (
    OURS,
    PARTS,
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
    run_once,
)

WIDTHS = {"LI": 200, "HI": 200, "HO": 200, "HOmod": 20}
MODULES = ("benchmarks.devstone_ours", "benchmarks.devstone_xdevs")


def main() -> int:
    """Measure the shapes asked for; return the exit status."""
    arguments = _arguments()
    if peer_version() is None:
        print(missing_peer(), file=sys.stderr)
        return 2
    report: dict[str, Any] = {"conditions": conditions(), "models": []}
    if not arguments.json:
        runs = f"medians of {arguments.repetitions} runs each"
        print(f"DEVStone, zero-time Dhrystone: CPU seconds, {runs}")
        print(conditions_text(report["conditions"]))
    for shape in arguments.models:
        width = arguments.width or WIDTHS[shape]
        try:
            result = measure(shape, width, arguments.depth, arguments.repetitions)
        except WrongCountError as error:
            print(f"benchmarks: {shape} {width}x{arguments.depth}: {error}", file=sys.stderr)
            return 1
        report["models"].append(result)
        if not arguments.json:
            _print_result(result)
    report["ratio"] = min(result["ratio"] for result in _weighty(report["models"]))
    _print_end(report, as_json=arguments.json)
    return 0


def measure(shape: str, width: int, depth: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    each = transitions(shape, width, depth)
    expected = {"internal": each, "external": each}
    check_counts(PEER, run_once(MODULES[1], shape, width, depth, "count"), expected)
    ours, peers = in_turns(MODULES, repetitions, shape, width, depth)
    for sample in ours:
        check_counts(OURS, sample, expected)
    seconds = {OURS: medians(ours), PEER: medians(peers)}
    return {
        "model": shape,
        "width": width,
        "depth": depth,
        "seconds": seconds,
        "totals": {OURS: [sample.total for sample in ours], PEER: [s.total for s in peers]},
        "transitions": 2 * each,
        "ratio": seconds[PEER]["total"] / seconds[OURS]["total"],
    }


def _print_result(result: Mapping[str, Any]) -> None:
    print(f"\n{result['model']} {result['width']}x{result['depth']}")
    columns = (*PARTS, "total")
    print(f"{'':18}" + "".join(f"{column:>11}" for column in columns))
    for engine, seconds in result["seconds"].items():
        print(f"{engine:18}" + "".join(f"{seconds[column]:11.4f}" for column in columns))
    print(f"transitions {result['transitions']}, as published, by both")


def _print_end(report: Mapping[str, Any], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(report))
        return
    print()
    for result in report["models"]:
        print(f"ratio {result['model']} {result['ratio']:.1f}")
    names = ", ".join(result["model"] for result in _weighty(report["models"]))
    print(f"ratio {report['ratio']:.1f} (the least of {names})")


def _weighty(results: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """All but LI, unless it is alone: it runs for so short a time that it measures set-up."""
    return [result for result in results if result["model"] != "LI"] or results


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.devstone", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--models", nargs="+", choices=list(SHAPES), default=list(SHAPES))
    parser.add_argument("--width", type=positive, help="atomics a level; default 200, for HOmod 20")
    parser.add_argument("--depth", type=positive, default=20, help="levels; default 20")
    parser.add_argument("--repetitions", type=positive, default=5, help="runs of each engine")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
