"""The gate itself: pairs are measured until a look decides, or there are as many as allowed.

Then what was found is said, for people: the verdict first, figures and conditions after it.
"""

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from statistics import median
from time import monotonic
from typing import Any

from msgspec import Struct

from firmware_runtime.lab.gate.checkouts import Checkout
from firmware_runtime.lab.gate.decision import (
    ERROR,
    LOOKS,
    Decision,
    Verdict,
    decide,
    looks_of,
)
from firmware_runtime.lab.gate.pairs import Pair
from firmware_runtime.system.conditions import Neighbours, busy, system_conditions


class Outcome(Struct, frozen=True, kw_only=True):
    """A decision and what it was made from, as `--json` prints it; docs/performance.md."""

    decision: Decision
    tolerance: float
    most_pairs: int
    cost_of: str
    """Unit of a cost: `1 s of robot time`, `a run of the command`."""
    base_us: float
    """The median cost of that, us of processor time."""
    head_us: float
    log_ratios: list[float]
    reasons: list[str]
    """Disturbances of the measurement; a sentence each."""
    notes: list[str]
    """Differences between the work of both versions."""
    neighbours: dict[str, float]
    conditions: dict[str, Any]
    elapsed_s: float


def pass_gate(
    more: Generator[Pair, None, None],
    cost_of: str,
    tolerance: float,
    most_pairs: int,
    show: Callable[[int, int], None] = lambda *_: None,
) -> Outcome:
    """Measure and decide; `show` gets how many pairs there are, and may be. Raises ConfigError."""
    began, neighbours = monotonic(), Neighbours()
    looks = looks_of(most_pairs)
    pairs: list[Pair] = []
    with closing(more):
        for number, look in enumerate(looks, 1):
            while len(pairs) < look:
                show(len(pairs), looks[-1])
                pairs.append(next(more))
            decision = decide([pair.log_ratio for pair in pairs], tolerance, number)
            if decision.verdict is not Verdict.CANNOT_TELL:
                break
    shares = dict(neighbours.shares())
    return Outcome(
        decision=decision,
        tolerance=tolerance,
        most_pairs=looks[-1],
        cost_of=cost_of,
        base_us=median(each.base.ns / each.base.span_s for each in pairs) / 1000,
        head_us=median(each.head.ns / each.head.span_s for each in pairs) / 1000,
        log_ratios=[pair.log_ratio for pair in pairs],
        reasons=busy(shares),
        notes=_notes(pairs),
        neighbours=shares,
        conditions=system_conditions(),
        elapsed_s=monotonic() - began,
    )


def _notes(pairs: list[Pair]) -> list[str]:
    base = sum(each.base.activations for each in pairs)
    head = sum(each.head.activations for each in pairs)
    unlike = f"in the same robot time BASE had {base} activations, HEAD {head}"
    return [unlike] if base != head else []


def gate_lines(outcome: Outcome, versions: tuple[Checkout, Checkout]) -> Iterator[str]:
    """The verdict first; then figures and conditions."""
    decision = outcome.decision
    yield f"{decision.verdict}: {_sentence(decision, f'{outcome.tolerance:.1%}')}"
    for checkout, cost_us in zip(versions, (outcome.base_us, outcome.head_us), strict=True):
        version = f" ({checkout.commit[:12]})" if checkout.commit else ""
        cost = f"{cost_us / 1000:.4g} ms of processor time for {outcome.cost_of}"
        yield f"  {checkout.name} {checkout.stated}{version}: {cost}"
    bounds = f"{decision.ratio_low:.3f} to {decision.ratio_high:.3f}, {1 - 2 * ERROR:.0%}"
    yield f"  HEAD by BASE {decision.ratio:.3f} ({bounds}); tolerance {outcome.tolerance:.1%}"
    yield (
        f"  {decision.pairs} pairs of {outcome.most_pairs} at most, look {decision.looks} of "
        f"{LOOKS}, signed ranks: slower p = {decision.p_slower:.2g}, no slower "
        f"p = {decision.p_no_slower:.2g}; {outcome.elapsed_s:.1f} s"
    )
    yield from (f"  note: {each}" for each in outcome.notes)
    stated, shares = outcome.conditions, outcome.neighbours
    where = [stated[name] for name in ("kernel", "machine", "python", "scheduler")]
    others = f"other processes {shares['processes']:.0%}, the host {shares['host']:.0%}"
    yield f"  conditions: {', '.join(where)}, {stated['cpu_count']} processors, {others}"
    yield from (f"  disturbs: {each}" for each in outcome.reasons)


def _sentence(decision: Decision, tolerance: str) -> str:
    if decision.verdict is Verdict.CANNOT_TELL:
        return (
            f"the ratio may be anything from {decision.ratio_low:.3f} to "
            f"{decision.ratio_high:.3f}, which is on both sides of the tolerance of {tolerance}; "
            "expected more --pairs, a quieter machine, or another --tolerance"
        )
    more = "no more than" if decision.verdict is Verdict.NO_SLOWER else "more than"
    return f"HEAD takes {more} {tolerance} more processor time than BASE"
