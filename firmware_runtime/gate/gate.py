"""The gate itself: pairs are measured until a look decides, or there are as many as allowed."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from statistics import median
from time import monotonic
from typing import Any

from firmware_runtime.gate.pairs import Measured, Pair
from firmware_runtime.gate.reasons import reasons_here
from firmware_runtime.gate.sequential import (
    ERROR,
    LEVEL,
    LOOKS,
    Decision,
    Verdict,
    decide,
    looks_of,
)
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.neighbours import Neighbours

Shown = Callable[[int, int, Decision | None], None]
"""Gets how many pairs there are, how many there may be, and what the last look said."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """A decision, what it was made from, and what spoke against making one here."""

    decision: Decision
    pairs: list[Pair]
    most_pairs: int
    tolerance: float
    unit: str
    base_ns: float
    """The median cost of one unit, ns of processor time."""
    head_ns: float
    reasons: list[str]
    """What disturbs a measurement on this machine, or did; a sentence each."""
    notes: list[str]
    """Where the versions do not do the same work."""
    conditions: dict[str, Any]
    neighbours: dict[str, float]
    elapsed_s: float

    def as_json(self) -> dict[str, Any]:
        """What `gate --json` prints; docs/timing-gate.md has the keys."""
        decision = self.decision
        return {
            "verdict": decision.verdict.value,
            "ratio": decision.ratio,
            "ratio_low": _finite(decision.low),
            "ratio_high": _finite(decision.high),
            "certainty": 1 - 2 * ERROR,
            "tolerance": self.tolerance,
            "p_slower": decision.p_slower,
            "p_no_slower": decision.p_no_slower,
            "error": ERROR,
            "level_of_a_look": LEVEL,
            "looks": decision.looks,
            "most_looks": LOOKS,
            "pairs": decision.pairs,
            "most_pairs": self.most_pairs,
            "cost_of": self.unit,
            "base_us": self.base_ns / 1000,
            "head_us": self.head_ns / 1000,
            "spread": spread(self.pairs),
            "log_ratios": [pair.log_ratio for pair in self.pairs],
            "reasons": self.reasons,
            "notes": self.notes,
            "neighbours": self.neighbours,
            "conditions": self.conditions,
            "elapsed_s": self.elapsed_s,
        }


def pass_gate(
    measured: Measured, tolerance: float, most_pairs: int, show: Shown = lambda *_: None
) -> Outcome:
    """Measure and decide. Raises ConfigError for what cannot be measured."""
    began, neighbours = monotonic(), Neighbours()
    looks = looks_of(most_pairs)
    pairs: list[Pair] = []
    decision: Decision | None = None
    with closing(measured.pairs()) as more:
        for number, look in enumerate(looks, 1):
            while len(pairs) < look:
                show(len(pairs), looks[-1], decision)
                pairs.append(next(more))
            decision = decide([pair.log_ratio for pair in pairs], tolerance, number)
            if decision.verdict is not Verdict.CANNOT_TELL:
                break
    assert decision is not None  # noqa: S101 -- there is a look
    shares = dict(neighbours.shares())
    return Outcome(
        decision=decision,
        pairs=pairs,
        most_pairs=looks[-1],
        tolerance=tolerance,
        unit=measured.unit,
        base_ns=median(pair.base_ns for pair in pairs) / measured.units,
        head_ns=median(pair.head_ns for pair in pairs) / measured.units,
        reasons=reasons_here(shares),
        notes=measured.notes(),
        conditions=system_conditions(),
        neighbours=shares,
        elapsed_s=monotonic() - began,
    )


def spread(pairs: list[Pair]) -> float:
    """How far pairs lie apart: the median distance of their log ratios from the median one."""
    ratios = [pair.log_ratio for pair in pairs]
    centre = median(ratios)
    return median(abs(each - centre) for each in ratios)


def _finite(bound: float) -> float | None:
    """A bound as JSON has it: null for none."""
    return bound if 0 < bound < float("inf") else None
