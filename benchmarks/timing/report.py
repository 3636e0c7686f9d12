"""What rounds of runs say: percentiles, ratios within a round, one histogram of each contestant.

A ratio is that of two runs of the same round, seconds apart; the median over the rounds is kept. So
a machine that grows slower in the course of minutes changes none, and a stall spoils one round.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from benchmarks.timing.contestants import CYCLICTEST, Lateness, Taken, Task

PLAIN, SPINNING = "executive", "executive, spinning"
PERCENTILES = {"p50": 500, "p99": 990, "p999": 999}
GOALS = {PLAIN: {"p50": 1.3, "p99": 1.5}, SPINNING: {"p50": 1.0, "p99": 1.0}}
"""Ratios to cyclictest, at most, with SCHED_FIFO at 1 kHz, all processors kept awake."""
GOALS_PERIOD_NS = 1_000_000
EDGES = [step * 10**power for power in range(2, 9) for step in (10, 15, 20, 30, 50, 70)]
"""Where rows of the printed histogram end, ns."""

Round = Mapping[str, Taken]


def summary(rounds: Sequence[Round], task: Task, base: str) -> dict[str, Any]:
    """Figures of all contestants, and ratios to the one called `base`."""
    names = list(rounds[0])
    ratios = {
        name: {key: _ratio(rounds, name, base, rank) for key, rank in PERCENTILES.items()}
        for name in names
        if name != base
    }
    has_goals = base == CYCLICTEST and task.keep_awake and task.priority > 0
    return {
        "contestants": {name: _figures([each[name] for each in rounds]) for name in names},
        "base": base,
        "ratios": ratios,
        "goals": GOALS if has_goals and task.period_ns == GOALS_PERIOD_NS else {},
        "settings": rounds[0][PLAIN].settings,
        "ratio": next(iter(ratios.values()))["p99"],
    }


def _ratio(rounds: Sequence[Round], name: str, base: str, rank: int) -> float:
    return median(
        each[name].lateness.percentile(rank) / each[base].lateness.percentile(rank)
        for each in rounds
    )


def _figures(runs: Sequence[Taken]) -> dict[str, Any]:
    """Medians over the runs, in ns; `histogram` is of all together, by the end of a row."""
    outputs = [run.output for run in runs if run.output is not None]
    skipped = [run.skipped for run in runs if run.skipped is not None]
    return {
        **_percentiles([run.lateness for run in runs]),
        "output": _percentiles(outputs) if outputs else None,
        "cpu": median(run.cpu for run in runs),
        "samples": sum(run.lateness.count for run in runs),
        "skipped": sum(skipped) if skipped else None,
        "histogram": _histogram([run.lateness for run in runs]),
    }


def _percentiles(runs: Sequence[Lateness]) -> dict[str, float]:
    medians = {
        key: median(run.percentile(rank) for run in runs) for key, rank in PERCENTILES.items()
    }
    return {**medians, "max": max(run.largest for run in runs)}


def _histogram(runs: Sequence[Lateness]) -> dict[str, int]:
    rows = dict.fromkeys(EDGES, 0)
    for run in runs:
        for lateness, count in run.samples:
            rows[EDGES[min(bisect_right(EDGES, lateness), len(EDGES) - 1)]] += count
    return {str(edge): count for edge, count in rows.items() if count > 0}
