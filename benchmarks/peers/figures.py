"""What the activations of a run say: lateness, drift, and what a stall did.

An engine's schedule is its own: activation n is due n periods after an origin that the earliest
activation shows, so a constant offset is no lateness. Drift is how fast the earliest activations of
a tenth of the run leave the schedule behind; those of the others only say how late they were.
"""

from collections.abc import Mapping, Sequence
from itertools import takewhile
from statistics import median
from typing import Any, TypeAlias

from benchmarks.peers.plan import Plan

Figures: TypeAlias = Mapping[str, Any]
Round: TypeAlias = Mapping[str, Figures]
"""By engine."""


def quiet_figures(answer: Mapping[str, Any], plan: Plan) -> dict[str, Any]:
    """Lateness, drift and processor time of a run that nothing disturbed on purpose."""
    fired = answer["fired"]
    offsets = [instant - number * plan.period_ns for number, instant in fired]
    late = sorted(offset - min(offsets) for offset in offsets)
    return {
        "p50_us": late[len(late) // 2] / 1000,
        "p99_us": late[len(late) * 99 // 100] / 1000,
        "max_us": late[-1] / 1000,
        "drift_ppm": _drift(offsets, plan.period_ns) * 1e6,
        "cpu": answer["cpu_s"] / (plan.periods * plan.period_s),
        "settings": answer["settings"],
    }


def stall_figures(answer: Mapping[str, Any], plan: Plan) -> dict[str, Any]:
    """How many events were late after the stall, until when, and what was said about it.

    An event is late that comes more than half a period later than those before the stall did.
    """
    offsets = {number: instant - number * plan.period_ns for number, instant in answer["fired"]}
    stalled = next(number for number in offsets if number >= plan.stall_at)
    usual = median(offset for number, offset in offsets.items() if number < stalled)
    is_late = {
        number: offset - usual > plan.period_ns / 2
        for number, offset in offsets.items()
        if number > stalled
    }
    late = list(takewhile(is_late.__getitem__, is_late))
    on_time = [number for number in is_late if not is_late[number]]
    stalled_until = dict(answer["fired"])[stalled] + plan.stall_ns
    return {
        "late_events": len(late),
        "in_phase_after_ms": (dict(answer["fired"])[on_time[0]] - stalled_until) / 1e6
        if on_time
        else None,
        "told": answer["told"],
    }


def _drift(offsets: Sequence[int], period_ns: int) -> float:
    tenth = max(len(offsets) // 10, 1)
    passed = (len(offsets) - tenth) * period_ns
    return (min(offsets[-tenth:]) - min(offsets[:tenth])) / passed


def medians(rounds: Sequence[Round]) -> dict[str, dict[str, Any]]:
    """By engine, the median of every figure over the rounds."""
    return {
        name: {key: _middle([each[name][key] for each in rounds]) for key in figures}
        for name, figures in rounds[0].items()
    }


def _middle(values: Sequence[Any]) -> Any:  # noqa: ANN401 -- a number, or what is said in words
    """The median of numbers; of anything else, such as no number in some round, the last."""
    if all(isinstance(value, int | float) for value in values):
        return median(values)
    return values[-1]


def ratio(rounds: Sequence[Round], peer: str, ours: str) -> float:
    """The p99 of a peer by ours: of runs in the same round, and the median over the rounds."""
    return float(median(each[peer]["p99_us"] / each[ours]["p99_us"] for each in rounds))
