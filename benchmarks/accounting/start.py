"""From the start of a process to the end of TachoBot's first step, beside a bare interpreter.

The first step is found in the run's recording: the exact instant, whenever it is read. Byte code is
there already, as it is once a package has been installed. A start includes what the robot would not
have, making the doubles; and locking all memory, where that is granted.
"""

from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.shared.process import LoopError, Running, seconds_of_python, tachobot
from firmware_runtime.blackbox.found import recording_beside
from firmware_runtime.blackbox.reader import read_recording
from firmware_runtime.blackbox.section import Kind
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, STEPS
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


def first_step_ended(statistics: Statistics, path: Path) -> int:
    """When the first step of a run ended, on CLOCK_MONOTONIC, ns, by its recording.

    Raises LoopError where that no longer has it.
    """
    began = statistics.cells[HEARTBEAT] - statistics.cells[ELAPSED]
    recording = read_recording(path)
    sections = (each for segment in recording.segments() for each in segment.sections())
    first = next((each for each in sections if each.kind is Kind.STEP), None)
    if first is None or not recording.is_from_start:
        raise LoopError(f"{path}: the first step is no longer recorded")
    return began + first.readings[-1]


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
    ended = first_step_ended(statistics, recording_beside(running.statistics))
    return (ended - running.spawned_at) / 1e9
