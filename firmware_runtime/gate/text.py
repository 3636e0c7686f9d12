"""What the gate found, for people."""

from collections.abc import Iterator

from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.gate import Outcome
from firmware_runtime.gate.sequential import ERROR, LOOKS, Decision, Verdict

_RED, _PLAIN = "\x1b[1;31m", "\x1b[0m"
_CERTAINTY = f"{1 - 2 * ERROR:.0%}"
_SHORT = 12
"""Digits of a commit that are shown."""


def outcome_text(outcome: Outcome, base: Checkout, head: Checkout, *, in_colour: bool) -> str:
    """The verdict first, and red unless it is `no slower`; then figures and conditions."""
    verdict = outcome.decision.verdict
    lines = list(_lines(outcome, base, head))
    if in_colour and verdict is not Verdict.NO_SLOWER:
        lines[0] = f"{_RED}{lines[0]}{_PLAIN}"
    return "\n".join(lines)


def ratio_text(decision: Decision) -> str:
    """The ratio and where it lies."""
    return f"{decision.ratio:.3f} ({decision.low:.3f} to {decision.high:.3f}, {_CERTAINTY})"


def _lines(outcome: Outcome, base: Checkout, head: Checkout) -> Iterator[str]:
    decision = outcome.decision
    yield f"{decision.verdict}: {_sentence(outcome)}"
    for checkout, cost_ns in ((base, outcome.base_ns), (head, outcome.head_ns)):
        yield f"  {checkout.name} {_version(checkout)}: {_cost(cost_ns)} for {outcome.unit}"
    yield f"  HEAD by BASE {ratio_text(decision)}; tolerance {outcome.tolerance:.1%}"
    yield (
        f"  {decision.pairs} pairs of {outcome.most_pairs} at most, look {decision.looks} of "
        f"{LOOKS}, signed ranks: slower p = {decision.p_slower:.2g}, no slower "
        f"p = {decision.p_no_slower:.2g}; {outcome.elapsed_s:.1f} s"
    )
    yield from (f"  note: {each}" for each in outcome.notes)
    yield f"  conditions: {_conditions(outcome)}"
    if decision.verdict is not Verdict.NO_SLOWER or outcome.reasons:
        yield f"  disturbs: {'; '.join(outcome.reasons) or 'nothing that can be seen'}"


def _sentence(outcome: Outcome) -> str:
    """The verdict with its reason."""
    decision, tolerance = outcome.decision, f"{outcome.tolerance:.1%}"
    if decision.verdict is Verdict.CANNOT_TELL:
        return (
            f"the ratio may be anything from {decision.low:.3f} to {decision.high:.3f}, which is "
            f"on both sides of the tolerance of {tolerance}; expected more --pairs, a quieter "
            "machine, or another --tolerance"
        )
    if decision.verdict is Verdict.SLOWER:
        return f"HEAD takes more than {tolerance} more processor time than BASE"
    if decision.is_faster:
        return f"HEAD takes less processor time than BASE, by more than {tolerance} of HEAD's"
    return f"HEAD takes no more than {tolerance} more processor time than BASE"


def _version(checkout: Checkout) -> str:
    return f"{checkout.stated} ({checkout.commit[:_SHORT]})" if checkout.commit else checkout.stated


def _cost(cost_ns: float) -> str:
    return f"{cost_ns / 1e6:.4g} ms of processor time"


def _conditions(outcome: Outcome) -> str:
    stated, shares = outcome.conditions, outcome.neighbours
    words = [stated["kernel"], stated["machine"], stated["python"], stated["scheduler"]]
    words += [f"{stated['cpu_count']} processors"]
    if stated["governor"]:
        words.append(f"governor {stated['governor']}")
    words.append(f"other processes {shares['processes']:.0%}, the host {shares['host']:.0%}")
    return ", ".join(words)
