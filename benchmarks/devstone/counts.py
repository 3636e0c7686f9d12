"""How many transitions a DEVStone model has: the published formulas.

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


def transitions(shape: str, width: int, depth: int) -> int:
    """Internal transitions of all atomics, which is also the number of their external ones."""
    triangle = width * (width - 1) // 2
    if shape == "LI":
        return (width - 1) * (depth - 1) + 1
    if shape in {"HI", "HO"}:
        return triangle * (depth - 1) + 1
    rounds = [1 + above * (width - 1) for above in range(depth - 1)]
    return 1 + sum(each * triangle + (width - 1) * (each + width - 1) for each in rounds)
