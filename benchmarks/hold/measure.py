"""The hold model, measured on both engines: N uncoupled atomics that only wait."""

from typing import Any

from benchmarks.hold.plan import KINDS, transitions
from benchmarks.shared.side_by_side import OURS, PEER, check_counts, in_turns, medians

COUNTS = (1, 10, 50, 200, 1000)
MODULES = ("benchmarks.hold.ours", "benchmarks.hold.xdevs")

__all__ = ["COUNTS", "KINDS", "measure"]


def measure(kind: str, count: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    expected = {"internal": transitions(kind, count)}
    ours, peers = in_turns(MODULES, repetitions, kind, count)
    for who, samples in ((OURS, ours), (PEER, peers)):
        for sample in samples:
            check_counts(f"hold {count} {kind}: {who}", sample, expected)
    seconds = {OURS: medians(ours), PEER: medians(peers)}
    return {
        "periods": kind,
        "atomics": count,
        "seconds": seconds,
        "transitions": expected["internal"],
        "run_ratio": seconds[PEER]["run"] / seconds[OURS]["run"],
        "ratio": seconds[PEER]["total"] / seconds[OURS]["total"],
    }
