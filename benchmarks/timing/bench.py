"""The executive's wake-up beside cyclictest's: `firmware-runtime bench timing`.

The same period, priority and settings of the system, taking turns, every run in a process of its
own. cyclictest measures the wake-up alone. What the executive counts as lateness ends where its
step begins, so it contains what the loop does between waking and that; when the model's output
function had begun is printed too.
"""

import argparse
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from benchmarks.shared.results import conditions, finish, positive
from benchmarks.shared.side_by_side import turned
from benchmarks.timing.contestants import CYCLICTEST, Taken, Task, cyclictest, executive
from benchmarks.timing.contestants import is_installed as cyclictest_is_installed
from benchmarks.timing.report import PLAIN, SPINNING, summary
from benchmarks.timing.text import timing_lines
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status
from firmware_runtime.executive.process import CPU_DMA_LATENCY
from firmware_runtime.system.conditions import Neighbours

SUMMARY = "How late the executive wakes up, beside cyclictest in the same minutes."
NOTHING = "nothing"
AWAKE, ASLEEP, BOTH = "awake", "asleep", "both"

Run = Callable[[], Taken]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--rate", type=int, choices=(100, 1000), default=1000, help="Hz; default 1000"
    )
    parser.add_argument(
        "--against",
        choices=(CYCLICTEST, NOTHING),
        default=CYCLICTEST,
        help="the peer; against nothing, the spinning executive is compared with the plain one",
    )
    parser.add_argument(
        "--cpus",
        choices=(AWAKE, ASLEEP, BOTH),
        default=BOTH,
        help="whether all hold /dev/cpu_dma_latency at 0, so that no processor sleeps deeply; "
        "default both, one after the other",
    )
    parser.add_argument(
        "--seconds", type=positive_number, default=5.0, metavar="S", help="of one run; default 5"
    )
    parser.add_argument("--repetitions", type=positive, default=5, help="runs of each; default 5")
    parser.add_argument(
        "--spin",
        type=positive_number,
        default=150.0,
        metavar="US",
        help="before each deadline, for the executive that spins; default 150",
    )
    parser.add_argument(
        "--priority",
        type=int,
        choices=range(1, 99),
        default=80,
        metavar="1-98",
        help="of SCHED_FIFO, default 80; where it is not granted all have SCHED_OTHER",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio of p99 without spin comes last."""
    if arguments.against == CYCLICTEST and not cyclictest_is_installed():
        print(
            "firmware-runtime: bench timing: cyclictest is not installed; expected the Debian "
            "package rt-tests: apt install rt-tests",
            file=sys.stderr,
        )
        return Status.BAD_INPUT
    priority = arguments.priority if _may_have_fifo(arguments.priority) else 0
    task = Task(1_000_000_000 // arguments.rate, arguments.seconds, priority)
    before = conditions()
    sections = {
        state: _measure(state, replace(task, keep_awake=state == AWAKE), arguments)
        for state in _states(arguments.cpus)
    }
    report = {
        "conditions": before,
        "rate_hz": arguments.rate,
        "fifo_priority": priority,
        "spin_us": arguments.spin,
        "cpus": sections,
        "ratio": next(iter(sections.values()))["ratio"],
    }
    finish(arguments, f"timing-{arguments.rate}", report, timing_lines)
    return Status.OK


def _states(asked: str) -> list[str]:
    """What to measure; where processors may not be kept awake, only what is left."""
    states = [AWAKE, ASLEEP] if asked == BOTH else [asked]
    if AWAKE in states and not os.access(CPU_DMA_LATENCY, os.W_OK):
        print(f"bench timing: {CPU_DMA_LATENCY} may not be written: asleep only", file=sys.stderr)
        return [ASLEEP]
    return states


def _measure(state: str, task: Task, arguments: argparse.Namespace) -> dict[str, Any]:
    spinning = replace(task, spin_us=arguments.spin)
    entrants: dict[str, Run] = {
        PLAIN: lambda: executive(task),
        SPINNING: lambda: executive(spinning),
    }
    if arguments.against == CYCLICTEST:
        entrants = {CYCLICTEST: lambda: cyclictest(task), **entrants}
    neighbours = Neighbours()
    rounds = []
    for repetition in range(arguments.repetitions):
        print(
            f"bench timing: {state}, {repetition + 1} of {arguments.repetitions}", file=sys.stderr
        )
        rounds.append(_round(entrants, repetition))
    return {**summary(rounds, task, next(iter(entrants))), "others": neighbours.shares()}


def _round(entrants: Mapping[str, Run], repetition: int) -> dict[str, Taken]:
    """One run of each; who is first changes from round to round."""
    taken = {name: entrants[name]() for name in turned(list(entrants), repetition)}
    return {name: taken[name] for name in entrants}


def _may_have_fifo(priority: int) -> bool:
    """Whether the kernel grants it; all contestants then have it, or none has."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    os.sched_setscheduler(0, *before)
    return True
