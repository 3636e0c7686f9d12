"""What the gate found, for people: the verdict first; then figures and conditions."""

from collections.abc import Iterator

from firmware_runtime.lab.gate.checkouts import Checkout
from firmware_runtime.lab.gate.decision import (
    ERROR,
    LOOKS,
    Decision,
    Verdict,
)
from firmware_runtime.lab.gate.gate import Outcome


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
