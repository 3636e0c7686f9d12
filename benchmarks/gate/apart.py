"""Why the gate takes turns on one processor: how far the same code lies apart, and where.

Several processes of the same code run the same stretches in turns, on each processor.
"""

import os
from collections import defaultdict
from contextlib import ExitStack
from statistics import median

from benchmarks.gate.versions import BOARD
from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.side import Side

PROCESSES = 4
ROUNDS = 30
SPAN_S = 0.5
WARMING_S = 2.0


def apart(checkout: Checkout) -> dict[str, float]:
    """The dearest by the cheapest: processors, and processes on the same processor (the worst)."""
    cpus = sorted(os.sched_getaffinity(0))
    taken: dict[tuple[int, int], list[int]] = defaultdict(list)
    with ExitStack() as ends:
        sides = [ends.enter_context(Side(checkout, BOARD, [])) for _ in range(PROCESSES)]
        for side in sides:
            side.wait()
            side.stretch(cpus[0], WARMING_S)
        for number in range(ROUNDS):
            for cpu in cpus:
                for turn in range(PROCESSES):
                    which = (number + turn) % PROCESSES
                    taken[cpu, which].append(sides[which].stretch(cpu, SPAN_S).ns)
    costs = {key: median(stretches) for key, stretches in taken.items()}
    by_cpu = [[costs[cpu, which] for which in range(PROCESSES)] for cpu in cpus]
    means = [median(each) for each in by_cpu]
    return {
        "processors": max(means) / min(means),
        "processes": max(max(each) / min(each) for each in by_cpu),
    }
