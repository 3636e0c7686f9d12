"""Three ways to take the same steps, each timed: the simulator alone up to the executive's loop.

- bare: `Simulator.advance`, without instruments;
- accounted: the executive's step, its instruments and its ledger with a statistics file in shared
  memory, put together as `executive.loop` does it;
- loop: `Executive.run`, everything between two waits.

Every step is on time, on the real clock, which is set to the step's instant in all three. They run
in a row, without a sleep.
"""

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from time import monotonic_ns

from benchmarks.accounting.models import HastyClock, S, configuration, tickers
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress

WARM_UP = 200
"""Steps before the clock is read."""


def bare(count: int, steps: int, _directory: Path) -> float:
    """Microseconds a step, on the simulator alone."""
    clock, simulator = HastyClock(), Simulator(tickers(count), checked=False)

    def step() -> None:
        at = simulator.next_at
        clock.start(at)
        simulator.advance(at)

    return _timed(step, steps)


def accounted(count: int, steps: int, directory: Path) -> float:
    """Microseconds a step, with instruments and ledger."""
    return _timed(AccountedStep(count, directory), steps)


def loop(count: int, steps: int, directory: Path) -> float:
    """Microseconds from one wait of the executive to the next."""
    clock = StopwatchClock(WARM_UP, steps)
    executive = Executive(tickers(count), clock, list, configuration(directory))
    clock.when_done = partial(executive.request_stop, "measured")
    executive.run()
    return clock.spent / clock.passes / 1000


WAYS: dict[str, Callable[[int, int, Path], float]] = {
    "bare": bare,
    "accounted": accounted,
    "loop": loop,
}


class AccountedStep:
    """One step with everything that is accounted; call it. `statistics` has what was counted."""

    def __init__(self, count: int, directory: Path) -> None:
        root, clock = tickers(count), HastyClock()
        settings = configuration(directory)
        profiler = Profiler(root, clock.now, settings)
        simulator = profiler.simulator
        file = profiler.open_file({"conditions": {}}, settings.statistics_path)
        self.statistics = file.statistics
        self._clock, self._simulator, self._step = clock, simulator, profiler.step
        self._world_now = WorldClock(profiler.accounting.tolerance)
        progress = Progress(profiler.step, settings.max_lag, clock.speed)
        inbox = Inbox(clock.now)
        self._ledger = Ledger(file, profiler, inbox, clock, progress)
        self._next_at = lambda: simulator.next_at
        self._at = simulator.next_at

    def __call__(self) -> None:
        """Take the next step, as `Executive` does."""
        clock, step, simulator = self._clock, self._step, self._simulator
        at = self._at
        clock.start(at)
        step.begin(at)
        self._world_now.begin(at, step.started)
        simulator.advance(at)
        self._at = self._ledger.commit(clock.now(), self._next_at)


class StopwatchClock(HastyClock):
    """Adds up the time from one wait to the next in `spent`, ns; the first ones do not count.

    After `passes` that count it calls `when_done`: a machine that stood still has skipped some.
    """

    def __init__(self, leave_out: int, passes: int) -> None:
        super().__init__()
        self.spent = 0
        self.passes = -1 - leave_out
        self.when_done: Callable[[], None]
        self._wanted = passes
        self._left_at = 0

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Stop the watch, go to the deadline at once, start it."""
        entered_at = monotonic_ns()
        self.passes += 1
        if self.passes > 0:
            self.spent += entered_at - self._left_at
        if self.passes == self._wanted:
            self.when_done()
        super().wait(until, sources)
        self._left_at = monotonic_ns()
        return []


def _timed(step: Callable[[], None], steps: int) -> float:
    """Microseconds of one step, many in a row."""
    for _ in range(WARM_UP):
        step()
    with _no_garbage_collected():
        begun = monotonic_ns()
        for _ in range(steps):
            step()
        return (monotonic_ns() - begun) / steps / 1000


@contextmanager
def _no_garbage_collected() -> Iterator[None]:
    """As in the loop, where the collector works between the steps."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
