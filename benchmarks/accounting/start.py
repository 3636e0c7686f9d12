"""From the start of a process to the end of TachoBot's first step, beside a bare interpreter.

The first step is found in what the flight recorder has written: the exact instant, whenever it is
read. Byte code is there already, as it is once a package has been installed. A start includes what
the robot would not have, making the doubles; and locking all memory, where that is granted.
"""

from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.shared.process import LoopError, Running, seconds_of_python, tachobot
from firmware_runtime.statistics.companions import Companion
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, STEPS
from firmware_runtime.statistics.spans import read_spans
from firmware_runtime.statistics.statistics import Statistics

GOAL_S = 0.4
UNLOCKED = ("executive.lock_memory=false",)
_MORE_THAN_NEEDED_S = 60.0


def measure(directory: Path, repetitions: int) -> dict[str, Any]:
    """Medians of starts that take turns; byte code must be there."""
    rounds = [_round(directory) for _ in range(repetitions)]
    seconds = {name: median(each[name] for each in rounds) for name in rounds[0]}
    return {
        "seconds": seconds,
        "all_s": [each["as shipped"] for each in rounds],
        "goal_s": GOAL_S,
        "ratio": seconds["as shipped"] / seconds["python"],
    }


def text(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    seconds = result["seconds"]
    return [
        "From the start of a process to its first finished step, s, medians:",
        f"  bare python {seconds['python']:.3f}, python with numpy {seconds['numpy']:.3f}",
        f"  tachobot on doubles {seconds['as shipped']:.3f}",
        f"  the same, memory not locked {seconds['not locked']:.3f}",
        f"  goal on a PC: {result['goal_s']} s or less",
        f"ratio {result['ratio']:.1f} (start to first step, by the start of a bare python)",
    ]


def first_step_ended(statistics: Statistics, spans: Path) -> int:
    """When the first step of a run ended, on CLOCK_MONOTONIC, ns.

    Raises LoopError when the flight recorder no longer has it, or there was none.
    """
    began = statistics.cells[HEARTBEAT] - statistics.cells[ELAPSED]
    steps = [each for each in read_spans(spans) if each.track == "step"]
    if len(steps) < max(statistics.cells[STEPS], 1):
        raise LoopError(f"{spans}: the first step is no longer recorded")
    return began + steps[0].end_ns


def _round(directory: Path) -> dict[str, float]:
    return {
        "python": seconds_of_python(directory, "pass"),
        "numpy": seconds_of_python(directory, "import numpy"),
        "as shipped": _start(directory),
        "not locked": _start(directory, UNLOCKED),
    }


def _start(directory: Path, assignments: tuple[str, ...] = ()) -> float:
    with tachobot(directory, _MORE_THAN_NEEDED_S, assignments) as running:
        return _first_step(running)


def _first_step(running: Running) -> float:
    statistics = running.read_when(lambda statistics: statistics.cells[STEPS] > 0)
    ended = first_step_ended(statistics, Companion.SPANS.beside(running.statistics))
    return (ended - running.spawned_at) / 1e9
