"""The one loop that runs a model against a clock, real, scaled or virtual.

How it works. One pass of the loop

1. calls the hooks, then waits until the next event is due, taking what
   arrives meanwhile (`clocks`, `inbox`);
2. ends if that was asked for, a policy demands it, or the end of the run is reached;
3. works off one instant: the internal events due then, or inputs, or both (`devs.simulator`);
4. counts it (`accounting`, `ledger`), and sees whether logical time keeps up (`progress`).

Logical time is not the moment we woke. An internal event happens at its deadline, so a period does
not drift, and a run in real time that is never late is the run in virtual time. An input happens
when it arrived: what was due before that goes first, however late the loop is, and an input that
comes while the loop is late is not merged with the overdue events.

What comes before the loop and after it is the `executive`.
"""

from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.clocks import Clock, WorldClock
from firmware_runtime.executive.configuration import Configuration, Hook
from firmware_runtime.executive.garbage import SlackCollector
from firmware_runtime.executive.inbox import Arrivals, Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.outcome import Outcome, Readiness
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.statistics.file_header import RunState


class Loop:
    """Goes from event to event. `stop` ends it after the pass under way."""

    def __init__(
        self, profiler: Profiler, clock: Clock, world_now: WorldClock, configuration: Configuration
    ) -> None:
        self.inbox = Inbox(clock.now)
        self.arrivals = Arrivals(self.inbox, configuration.sources)
        self.progress = Progress(profiler.step, configuration.max_lag, clock.speed)
        self.readiness = Readiness(profiler.simulator, profiler.faults)
        self.hooks: list[Hook] = []
        self.collector: SlackCollector | None = None
        """Collects garbage while nothing is due, where that is not left to the interpreter."""
        self.stop: Outcome | None = None
        self._clock = clock
        self._world_now = world_now
        self._step = profiler.step
        self._accounting = profiler.accounting
        self._simulator = profiler.simulator
        self._tap = configuration.tap
        self._poll_by = NEVER

    def poll_by(self, at: int) -> None:
        """Let the hooks be called at instant `at` of the run at the latest; for a hook to call.

        It holds until they are called next, whenever that is.
        """
        self._poll_by = min(self._poll_by, at)

    def run(self, until: int, ledger: Ledger) -> Outcome:
        """Pass after pass up to and including instant `until`; steps are entered into the ledger.

        The clock has been started.
        """
        clock, arrivals, accounting, progress = (
            self._clock,
            self.arrivals,
            self._accounting,
            self.progress,
        )
        waits = clock.speed != 0
        at = self._next_at()
        while True:  # CPython 3.11 would not specialize a loop with a condition here
            if accounting.overrun != "" or progress.livelock != "":
                break
            due = at if at < until else until  # noqa: FURB136 -- sooner
            self._use_slack(due, ledger)
            if arrivals.waiting or (self.inbox.is_woken and not waits):
                sources = arrivals.sources(waits=waits)
            else:  # as that says, without the call
                sources = arrivals.all if waits else arrivals.others
            ready = clock.wait(min(due, self._poll_by), sources)
            now = clock.now()
            # from here to the first function of a model every microsecond is lateness
            if ready:
                arrivals.receive(ready, now)
                at = self._next_at()
            if self.stop is not None:
                return self.stop
            if accounting.has_limits and accounting.is_overdue(min(now, until)):
                break
            if at <= now and at <= until and at != NEVER:
                at = self._work_off(at, ledger)
            elif now >= until:
                return Outcome.reached(until)
            else:
                ledger.idle(now)
        return Outcome(RunState.OVERRUN, accounting.overrun or progress.livelock)

    def _next_at(self) -> int:
        """The instant of the next internal event or input, whichever comes first."""
        return min(self._simulator.next_at, self._arrival_at())

    def _arrival_at(self) -> int:
        """The instant of the next input; NEVER if none is there."""
        return self.arrivals.next_at(self._simulator.now)

    def _use_slack(self, until: int, ledger: Ledger) -> None:
        """Do what is better done now than in a step."""
        self._poll_by = NEVER
        if ledger.late.has_work:
            ledger.use_slack(until - self._clock.now())
        for hook in tuple(self.hooks):  # one may take itself away
            now = self._clock.now()
            hook.between_steps(now, until - now)
        if self.readiness.waiting:
            self.readiness.poll()
        if self.collector is not None:
            self.collector.offer(min(until, self._poll_by) - self._clock.now())

    def _work_off(self, at: int, ledger: Ledger) -> int:
        """One step: everything that happens at instant `at`, then its entries in the ledger.

        Returns when the next event is due.
        """
        step, tap, simulator, arrivals = self._step, self._tap, self._simulator, self.arrivals
        if tap is not None:
            begin = tap.begin  # as a local: CPython finds a function that an object has sooner so
            begin(at)
        step.begin(at)
        self._world_now.begin(at, step.started)
        try:
            if arrivals.waiting or arrivals.planned:
                for port, value in arrivals.take(at):
                    if tap is not None:  # first: a value that the port refuses ends the run
                        tap.entered(port, value)
                    simulator.inject(port, value)
            simulator.advance(at)
        finally:
            has_input = arrivals.waiting or arrivals.planned
            next_at = ledger.commit(self._arrival_at() if has_input else NEVER)
        if tap is not None:
            end = tap.end
            end(at, next_at)
        return next_at
