"""The executive's wake-up beside cyclictest's: `firmware-runtime bench timing`.

The same period, priority and settings of the system, taking turns. Figures are medians over
repetitions; ratios are the executive's by cyclictest's. cyclictest measures the wake-up alone, the
executive's samples end where the model's output function begins.
"""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from benchmarks.results import add_common_options, save
from benchmarks.side_by_side import conditions, positive
from benchmarks.timing_contestants import (
    CYCLICTEST,
    Contestant,
    Taken,
    Task,
    cyclictest,
    executive,
    is_installed,
)
from benchmarks.timing_text import timing_text
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.cli.status import Status
from firmware_runtime.executive.conditions import system_conditions

SUMMARY = "How late the executive wakes up, beside cyclictest in the same minutes."
PERCENTILES = {"p50": 500, "p99": 990, "p999": 999}
PLAIN, SPINNING = "executive", "executive, spinning"
GOALS = {PLAIN: {"p50": 1.3, "p99": 1.5}, SPINNING: {"p50": 1.0, "p99": 1.0}}
"""Ratios to cyclictest, at most, with SCHED_FIFO at 1 kHz on an idle machine."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--rate", type=int, choices=(100, 1000), default=1000, help="Hz")
    parser.add_argument("--against", choices=(CYCLICTEST,), default=CYCLICTEST, help="the peer")
    parser.add_argument(
        "--seconds", type=positive_number, default=10.0, metavar="S", help="of one run"
    )
    parser.add_argument("--repetitions", type=positive, default=3, help="runs of each")
    parser.add_argument(
        "--spin",
        type=positive_number,
        default=150.0,
        metavar="US",
        help="before each deadline, for the third contestant; default 150",
    )
    parser.add_argument(
        "--priority",
        type=int,
        choices=range(1, 99),
        default=80,
        metavar="1-98",
        help="of SCHED_FIFO",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio of p99 without spin comes last."""
    if not is_installed():
        print(
            "firmware-runtime: bench timing: cyclictest is not installed; expected the Debian "
            "package rt-tests: apt install rt-tests",
            file=sys.stderr,
        )
        return Status.BAD_INPUT
    priority = arguments.priority if _may_have_fifo(arguments.priority) else 0
    plain = Task(1_000_000_000 // arguments.rate, arguments.seconds, priority, 0.0)
    spinning = Task(plain.period_ns, plain.seconds, priority, arguments.spin)
    entrants: dict[str, tuple[Contestant, Task]] = {
        CYCLICTEST: (cyclictest, plain),
        PLAIN: (executive, plain),
        SPINNING: (executive, spinning),
    }
    taken: dict[str, list[Taken]] = {name: [] for name in entrants}
    for repetition in range(arguments.repetitions):
        for name, (contestant, task) in entrants.items():
            print(f"bench timing: {repetition + 1}: {name}", file=sys.stderr)
            taken[name].append(contestant(task))
    report = report_of(taken, rate_hz=arguments.rate, priority=priority, spin_us=arguments.spin)
    save(arguments.save, f"timing-{arguments.rate}", report)
    print(json.dumps(report) if arguments.json else timing_text(report))
    return Status.OK


def report_of(
    taken: Mapping[str, Sequence[Taken]], *, rate_hz: int, priority: int, spin_us: float
) -> dict[str, Any]:
    """Medians and ratios of all contestants, and one histogram of each, in powers of two."""
    figures = {name: _figures(runs) for name, runs in taken.items()}
    peer = figures[CYCLICTEST]
    ratios = {
        name: {key: found[key] / peer[key] for key in PERCENTILES}
        for name, found in figures.items()
        if name != CYCLICTEST
    }
    return {
        "conditions": {
            **system_conditions(),
            "cpu": conditions()["cpu"],
            "load": os.getloadavg()[0],
            "rate_hz": rate_hz,
            "fifo_priority": priority,
            "spin_us": spin_us,
            "settings": taken[PLAIN][0].settings,
        },
        "goals": GOALS,
        "contestants": figures,
        "ratios": ratios,
        "ratio": ratios[PLAIN]["p99"],
    }


def _figures(runs: Sequence[Taken]) -> dict[str, Any]:
    octaves: dict[int, int] = {}
    for run in runs:
        for lateness, count in run.samples:
            octave = lateness.bit_length()
            octaves[octave] = octaves.get(octave, 0) + count
    return {
        **{
            name: median(run.percentile(rank) for run in runs) for name, rank in PERCENTILES.items()
        },
        "max": max(run.largest for run in runs),
        "cpu": median(run.cpu for run in runs),
        "samples": sum(run.count for run in runs),
        "octaves": {str(octave): octaves[octave] for octave in sorted(octaves)},
    }


def _may_have_fifo(priority: int) -> bool:
    """Whether the kernel grants it; both sides then have it, or neither has."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    os.sched_setscheduler(0, *before)
    return True
