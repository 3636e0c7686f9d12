"""Lateness with a recording by that without one: a ratio of pairs, and how sure it is.

The p99 of one and the same run is another each time, by a factor of two beside other work. So each
turn has a second bare run, and what is said of a recording is said of that one, too: what differs
there is the machine's. The decision is the timing gate's (`firmware_runtime.lab.gate`).
"""

from collections.abc import Mapping, Sequence
from math import inf, log
from typing import Any

from firmware_runtime.lab.gate.decision import FEWEST_PAIRS, Verdict, decide

TOLERANCE = 0.02
"""The goal: a recording makes the p99 of lateness at most so much longer."""
_SHORTEST_US = 0.001
"""A run that was never late was late by less than the clock resolves."""
_SAID = {
    Verdict.NO_SLOWER: "within it",
    Verdict.SLOWER: "missed",
    Verdict.CANNOT_TELL: "cannot tell here",
}


def compared(runs: Mapping[str, Sequence[float]], name: str, bare: str) -> dict[str, Any]:
    """The ratio of a kind of run to the bare ones, in pairs; no bound is None."""
    pairs = zip(runs[name], runs[bare], strict=True)
    found = decide(
        [log(max(of, _SHORTEST_US) / max(by, _SHORTEST_US)) for of, by in pairs], TOLERANCE
    )
    return {
        "ratio": found.ratio,
        "low": found.ratio_low if found.ratio_low > 0 else None,
        "high": found.ratio_high if found.ratio_high < inf else None,
        "verdict": _SAID[found.verdict],
    }


def text(found: Mapping[str, Any], pairs: int) -> str:
    """The ratio, and where it lies."""
    ratio, low, high = found["ratio"], found["low"], found["high"]
    if low is None or high is None:
        return f"{ratio:.3f} (bounds need {FEWEST_PAIRS} pairs or more, not {pairs})"
    return f"{ratio:.3f} ({low:.3f} to {high:.3f} with 98 % or more)"
