"""Late activations of a run as they come, with what ran instead of each."""

from collections.abc import Iterator
from pathlib import Path

from msgspec import to_builtins

from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, WRITTEN
from firmware_runtime.statistics.number_formats import instant, microseconds
from firmware_runtime.statistics.ran_instead import RanInstead, ran_instead
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.switch_trace import SwitchTrace

MARGIN_NS = 500_000
"""How inexactly the run's clock is known beside the trace's, ns."""


class LateOne:
    """A late activation with its cause; `instead` is None where nothing was traced."""

    def __init__(self, activation: WorstActivation, instead: list[RanInstead] | None) -> None:
        self._activation = activation
        self._instead = instead

    def text(self) -> str:
        """It in a line."""
        late, blame = self._activation, self._activation.blame
        why = "unknown" if blame is None else sentence(blame)
        return (
            f"{late.model} at {instant(late.t_ns)}, {microseconds(late.lateness_us)} late, step "
            f"{microseconds(late.step_us)}: {why}; ran instead: {self._who()}"
        )

    def as_json(self) -> dict[str, object]:
        """It as JSON: the entry of `worst` in the statistics, and `ran_instead`."""
        return {**to_builtins(self._activation), "ran_instead": to_builtins(self._instead)}

    def _who(self) -> str:
        if self._instead is None:
            return "unknown"
        return ", ".join(each.text() for each in self._instead[:3]) or "nothing"


class Follower:
    """Finds what is new among a run's worst activations, and what ran instead."""

    def __init__(self, kept: Path, statistics: Statistics, trace: SwitchTrace | None) -> None:
        self._kept = kept
        self._pid = statistics.header.writer.pid
        self._trace = trace
        self._seen = {each.t_ns for each in statistics.figures().worst}

    def new_in(self, statistics: Statistics) -> Iterator[LateOne]:
        """Those that have come since the last time and have a cause, in order of time."""
        worst = [each for each in statistics.figures().worst if each.t_ns not in self._seen]
        fresh = sorted((each for each in worst if each.blame is not None), key=instant_of)
        self._seen |= {each.t_ns for each in worst}
        switches = self._trace.read() if self._trace is not None and fresh else None
        began = run_began(statistics)
        for each in fresh:
            since = began + each.t_ns - MARGIN_NS
            until = since + round((each.lateness_us + each.step_us) * 1000) + 2 * MARGIN_NS
            found = None if switches is None else ran_instead(switches, self._pid, since, until)
            yield LateOne(each, found)


def run_began(statistics: Statistics) -> int:
    """When the run's clock was at zero, CLOCK_MONOTONIC, ns; of real time."""
    cells = statistics.cells
    return max(cells[WRITTEN], cells[HEARTBEAT]) - cells[ELAPSED]


def instant_of(activation: WorstActivation) -> int:
    """Return its deadline, ns of the run."""
    return activation.t_ns
