"""DEVStone's shapes, measured on both engines, and how many transitions each has.

In every shape an atomic has as many internal transitions as external ones, as it answers each bag
once and at once; so one number says both. It is derived level by level, outermost first; w and d
stand for width and depth.

- LI: every atomic gets the seed: one transition each, for (w - 1)(d - 1) + 1 atomics.
- HI, HO: the seed reaches all w - 1 atomics of a level, and each answer travels down the chain; the
  i-th atomic has i transitions: w(w - 1)/2 a level, and one for the innermost atomic.
- HOmod: a level below k others gets its second input in 1 + k(w - 1) rounds, which each set all
  rows of its triangle going, w(w - 1)/2 atomics; the first row gets each of them too, and is fed by
  the second for w - 1 rounds more: w - 1 atomics with w + k(w - 1) transitions.

Source: the formulas are those that the tests of xdevs.rs 0.4.0 (src/devstone/*.rs) and of
SimulationEverywhere/devstone-comparative check their engines by, after Cardenas et al., "The
DEVStone metric", ACM TOMACS 32 (3), 2022.
"""

from typing import Any

from benchmarks.shared.side_by_side import (
    OURS,
    PEER,
    check_counts,
    compared,
    in_turns,
    run_once,
)

WIDTHS = {"LI": 200, "HI": 200, "HO": 200, "HOmod": 20}
MODULES = ("benchmarks.devstone.ours", "benchmarks.devstone.xdevs")


def transitions(shape: str, width: int, depth: int) -> int:
    """Internal transitions of all atomics, which is also the number of their external ones."""
    triangle = width * (width - 1) // 2
    if shape == "LI":
        return (width - 1) * (depth - 1) + 1
    if shape in {"HI", "HO"}:
        return triangle * (depth - 1) + 1
    rounds = [1 + above * (width - 1) for above in range(depth - 1)]
    return 1 + sum(each * triangle + (width - 1) * (each + width - 1) for each in rounds)


def measure(shape: str, width: int, depth: int, repetitions: int) -> dict[str, Any]:
    """Both engines on one model. Raises WrongCountError."""
    each = transitions(shape, width, depth)
    expected = {"internal": each, "external": each}
    where = f"{shape} {width}x{depth}: "
    check_counts(where + PEER, run_once(MODULES[1], shape, width, depth, "count"), expected)
    ours, peers = in_turns(MODULES, repetitions, shape, width, depth)
    for sample in ours:
        check_counts(where + OURS, sample, expected)
    return {
        "width": width,
        "depth": depth,
        "totals": {OURS: [sample.total for sample in ours], PEER: [s.total for s in peers]},
        "transitions": 2 * each,
        **compared(ours, peers),
    }
