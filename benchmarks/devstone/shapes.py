"""DEVStone's shapes, measured on both engines."""

from typing import Any

from benchmarks.devstone.counts import transitions
from benchmarks.shared.side_by_side import OURS, PEER, check_counts, in_turns, medians, run_once

WIDTHS = {"LI": 200, "HI": 200, "HO": 200, "HOmod": 20}
MODULES = ("benchmarks.devstone.ours", "benchmarks.devstone.xdevs")


def measure(shape: str, width: int, depth: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    each = transitions(shape, width, depth)
    expected = {"internal": each, "external": each}
    where = f"{shape} {width}x{depth}: "
    check_counts(where + PEER, run_once(MODULES[1], shape, width, depth, "count"), expected)
    ours, peers = in_turns(MODULES, repetitions, shape, width, depth)
    for sample in ours:
        check_counts(where + OURS, sample, expected)
    seconds = {OURS: medians(ours), PEER: medians(peers)}
    return {
        "width": width,
        "depth": depth,
        "seconds": seconds,
        "totals": {OURS: [sample.total for sample in ours], PEER: [s.total for s in peers]},
        "transitions": 2 * each,
        "run_ratio": seconds[PEER]["run"] / seconds[OURS]["run"],
        "ratio": seconds[PEER]["total"] / seconds[OURS]["total"],
    }
