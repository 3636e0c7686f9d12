"""The hold model on both engines: N uncoupled atomics that only wait, period after period.

It measures what an engine needs to find out who is next. The periods are all equal, so all are due
together, or all distinct, so hardly ever two are.
"""

from typing import Any

from benchmarks.shared.side_by_side import OURS, PEER, check_counts, compared, in_turns

COUNTS = (1, 10, 50, 200, 1000)
MODULES = ("benchmarks.hold.ours", "benchmarks.hold.xdevs")
KINDS = ("equal", "distinct")
TRANSITIONS = 20_000
"""About how many internal transitions a run has."""
PERIOD = 1_000_003
"""The shortest period, ns; a prime, so distinct ones seldom meet."""


def periods(kind: str, count: int) -> list[int]:
    """The atomics' periods, ns."""
    return [PERIOD + (2 * number if kind == "distinct" else 0) for number in range(count)]


def end(count: int) -> int:
    """How long a run takes, ns."""
    return PERIOD * TRANSITIONS // count + PERIOD // 2


def transitions(kind: str, count: int) -> int:
    """How many internal transitions a run really has."""
    return sum(end(count) // period for period in periods(kind, count))


def measure(kind: str, count: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    expected = {"internal": transitions(kind, count)}
    ours, peers = in_turns(MODULES, repetitions, kind, count)
    for who, samples in ((OURS, ours), (PEER, peers)):
        for sample in samples:
            check_counts(f"hold {count} {kind}: {who}", sample, expected)
    return {
        "periods": kind,
        "atomics": count,
        "transitions": expected["internal"],
        **compared(ours, peers),
    }
