"""The same steps with the wait between them: at 100 Hz a step begins after a sleep.

What the loop does from the end of one wait to the beginning of the next, by `Executive.run` with
statistics file, beside a loop of nothing but a wait and `Simulator.advance`.
The two take turns; neither asks for a priority.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from time import monotonic_ns
from typing import Any

from benchmarks.accounting.cost import COUNTS
from benchmarks.accounting.models import S, configuration, tickers
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.executive import Executive

WARM_UP = 5
"""Steps that are left out at the beginning."""


class LapClock(MonotonicClock):
    """Real time that keeps, in `laps`, the ns from the end of each wait to the next wait.

    After that of `steps` steps it calls `when_done`: a machine that stood still has skipped some.
    """

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.laps: list[int] = []
        self.when_done: Callable[[], None] = lambda: None
        self._wanted = 1 + WARM_UP + steps
        self._left_at = monotonic_ns()

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Keep the lap, then sleep as the loop does."""
        self.laps.append(monotonic_ns() - self._left_at)
        if len(self.laps) == self._wanted:
            self.when_done()
        ready = super().wait(until, sources)
        self._left_at = monotonic_ns()
        return ready

    def median_us(self) -> float:
        """The median lap, the first ones left out."""
        return median(self.laps[WARM_UP:]) / 1000


def bare(count: int, steps: int) -> float:
    """Microseconds a step of the simulator alone."""
    clock, simulator = LapClock(steps), Simulator(tickers(count), checked=False)
    clock.start(0)
    while len(clock.laps) < WARM_UP + steps:  # a machine that stood still has missed some
        at = simulator.next_at
        while clock.now() < at:
            clock.wait(at, ())
        simulator.advance(at)
    return clock.median_us()


def loop(count: int, steps: int, directory: Path) -> float:
    """Microseconds a step of the executive."""
    clock = LapClock(steps)
    executive = Executive(tickers(count), clock, list, configuration(directory))
    clock.when_done = partial(executive.request_stop, "measured")
    executive.run()
    return clock.median_us()


def measure(directory: Path, repetitions: int, steps: int) -> dict[str, Any]:
    """Both loops with every number of models, in turns."""
    found = []
    for count in COUNTS:
        rounds = [(bare(count, steps), loop(count, steps, directory)) for _ in range(repetitions)]
        found.append(summary(count, rounds))
    return {"steps_of": found, "ratio": max(each["ratio"] for each in found)}


def summary(count: int, rounds: Sequence[tuple[float, float]]) -> dict[str, Any]:
    """What rounds of microseconds say, bare and by the executive."""
    return {
        "models": count,
        "bare_us": median(alone for alone, _ in rounds),
        "loop_us": median(loop for _, loop in rounds),
        "added_us": median(loop - alone for alone, loop in rounds),
        "ratio": median(loop / alone for alone, loop in rounds),
    }


def text(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    lines = [
        "Microseconds a step at 100 Hz, asleep in between, medians:",
        f"  {'models':>6}{'bare':>10}{'whole loop':>14}{'added':>10}{'an activation':>16}",
    ]
    lines += [
        f"  {each['models']:6}{each['bare_us']:10.1f}{each['loop_us']:14.1f}"
        f"{each['added_us']:10.1f}{each['added_us'] / each['models']:16.1f}"
        for each in result["steps_of"]
    ]
    return [*lines, f"ratio {result['ratio']:.1f} (the greatest, whole loop by bare)"]
