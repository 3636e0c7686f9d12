"""The executive: one loop that runs a model against a clock, real, scaled or virtual.

How it works. One pass of the loop

1. waits until the next event is due, taking what arrives meanwhile (`clocks`, `arrivals`);
2. ends if somebody asked for it, a policy demands it, or the end of the run is reached;
3. works off one instant: the internal events due then, or inputs, or both (`devs.simulator`);
4. counts it (`accounting`, `ledger`).

Logical time is not the moment we woke. An internal event happens at its deadline, so a period does
not drift, and a run in real time that is never late is the run in virtual time. An input happens
when it arrived: what was due before that goes first, however late the loop is, and an input that
comes while the loop is late is not merged with the overdue events.

The end is always the same: outputs are made safe, once, whatever happened; models exit; statistics
say how it ended; what the system granted is given back.
"""

from collections.abc import Callable
from typing import Any

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.executive.arrivals import Arrivals
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.conditions import system_conditions
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.garbage import SlackCollector
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.instruments import Instruments
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.process import Report, in_force
from firmware_runtime.executive.world_clock import WorldClock
from firmware_runtime.telemetry.statistics import RunState, Statistics
from firmware_runtime.telemetry.statistics_file import StatisticsFile

DEFAULT = Configuration()


class Executive:
    """Runs one model, once.

    `make_safe` puts the outputs into their safe state and returns what failed, one sentence each.
    `inbox` takes values for the root's input ports from anywhere in the process; `world_now` is the
    clock of a world that lives in it. Raises BoardError when policies or deadlines name what the
    model has not.
    """

    def __init__(
        self,
        root: Component,
        clock: Clock,
        make_safe: Callable[[], list[str]],
        configuration: Configuration = DEFAULT,
    ) -> None:
        self.clock = clock
        self.inbox = Inbox(clock.now)
        self._instruments = Instruments(root, clock.now, configuration)
        self.simulator = Simulator(root, instruments=self._instruments.for_simulator)
        self._instruments.attach(self.simulator)
        self.world_now = WorldClock(self._instruments.accounting.tolerance)
        self._make_safe = make_safe
        self._configuration = configuration
        self._arrivals = Arrivals(self.inbox, configuration.sources)
        self._collector: SlackCollector | None = None
        self._stop_reason: str | None = None
        self._ledger: Ledger | None = None

    @property
    def statistics(self) -> Statistics:
        """What has been counted so far. Raises RuntimeError before the run."""
        if self._ledger is None:
            raise RuntimeError("executive: no statistics before the run")
        return self._ledger.file.statistics()

    def request_stop(self, reason: str) -> None:
        """End the run after the step under way; safe in a signal handler and in any thread."""
        if self._stop_reason is None:
            self._stop_reason = reason
        self.inbox.wake()

    def run(self, until: int = NEVER) -> Outcome:
        """Run up to and including instant `until`; outputs have been made safe when it returns.

        An exception is in the outcome, not raised, but for SystemExit and its like.
        """
        if self._ledger is not None:
            raise RuntimeError("executive: a run cannot be repeated, expected a new executive")
        state, error, faults = RunState.FAILED, None, []
        with in_force(self._configuration.process, self.clock) as granted:
            try:
                self._open_ledger(granted)
                with self._instruments.garbage.measured():
                    state, reason = self._loop(until)
            except KeyboardInterrupt as interrupt:
                state, reason = RunState.STOPPED, "SIGINT"
            except BaseException as raised:
                error, reason = raised, str(raised)
            ...
