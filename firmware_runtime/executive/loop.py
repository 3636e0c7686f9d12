"""The executive: one loop that runs a model against a clock, real, scaled or virtual.

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

The end is always the same: outputs are made safe, whatever happened, and again while that fails
(`outcome`); models exit; statistics say how it ended; what the system granted is given back. A
pause gives that back, leaves outputs and statistics as they are, and is no time of the run.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive import process
from firmware_runtime.executive.clocks import Clock, MonotonicClock, WorldClock
from firmware_runtime.executive.configuration import Configuration, Hook
from firmware_runtime.executive.garbage import SlackCollector
from firmware_runtime.executive.inbox import AnySource, Arrivals, Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.outcome import Ending, Outcome, Readiness, SwitchOffRetry
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.statistics.conditions import Settings, settings_after
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import ELAPSED, YIELDED, Layout
from firmware_runtime.statistics.statistics import RunState, Statistics
from firmware_runtime.statistics.timeline import Lately

T = TypeVar("T")

DEFAULT = Configuration()


class Executive:
    """Runs one model, once.

    `make_safe` puts the outputs into their safe state and returns what failed, one sentence each;
    it may be left out for a model that drives nothing.
    `inbox` takes values for the root's input ports from anywhere in the process; `world_now` is the
    time of the lines and of a world that lives in it. Raises ConfigError when policies or deadlines
    name what the model has not.
    """

    def __init__(
        self,
        root: Component,
        clock: Clock,
        make_safe: Callable[[], list[str]] = list,
        configuration: Configuration = DEFAULT,
        world_now: WorldClock | None = None,
    ) -> None:
        self.clock = clock
        self.inbox = Inbox(clock.now)
        is_virtual = clock.speed == 0
        self._profiler = Profiler(root, clock.now, configuration, stands_still=is_virtual)
        self.simulator = self._profiler.simulator
        self.accounts = self._profiler.accounting.accounts
        self.faults = self._profiler.faults
        self.progress = Progress(self._profiler.step, configuration.max_lag, clock.speed)
        self.readiness = Readiness(self.simulator, self.faults)
        self.world_now = WorldClock() if world_now is None else world_now
        self.world_now.tolerance = self._profiler.accounting.tolerance
        off = SwitchOffRetry(make_safe, clock, configuration.switch_off_for, self._go_on_ending)
        self._tap = tap = configuration.tap
        exit_models = self.simulator.exit
        self._ending = Ending(
            exit_models if tap is None else partial(tap.exit, exit_models), self.readiness, off
        )
        self._configuration = configuration
        self._arrivals = Arrivals(self.inbox, configuration.sources)
        self._collector: SlackCollector | None = None
        self._granted: Settings = {}
        self._ledger = self._open_ledger({}, NEVER)
        self.hooks: list[Hook] = []
        self._poll_by = NEVER
        self._paused: Outcome | None = None
        self.reached = 0
        """The instant at which the run paused or ended, ns; 0 before."""
        self.is_over = False
        """Whether the run has ended; one that is paused has not."""
        self._has_begun = False
        self._stop: Outcome | None = None

    @property
    def statistics(self) -> Statistics:
        """What has been counted so far."""
        return self._ledger.file.statistics()

    def lately(self, since: int) -> Lately:
        """What became of activations since then, or up to a second before; costs little."""
        return self._ledger.lately(since)

    @property
    def granted(self) -> Settings:
        """What was asked of the system and holds, or why not; empty before the run began."""
        return settings_after(self._granted, self.cells[YIELDED])

    @property
    def holds_priority(self) -> bool:
        """Whether the run comes before ordinary processes."""
        return isinstance(self.clock, MonotonicClock) and process.holds_priority()

    def give_up_priority(self) -> None:
        """Be an ordinary process until the run ends; statistics say since when."""
        self._ledger.give_up_priority(self.clock.now())
        if self.holds_priority:
            process.give_up_priority()

    @property
    def cells(self) -> Cells:
        """The cells of the statistics, live, where other processes see them once the run began."""
        return self._ledger.file.cells

    @property
    def layout(self) -> Layout:
        """Where each number stands in the cells."""
        return self._ledger.file.layout

    @property
    def takes_time(self) -> bool:
        """Whether functions of models are timed."""
        return self._profiler.step.takes_time

    @property
    def state(self) -> dict[str, object]:
        """What it schedules and counts by, by name; inputs that have not arrived are none of it."""
        return {**self._profiler.state, "progress": self.progress, "ledger": self._ledger}

    def arm(self, *, armed: bool, generation: int) -> None:
        """Note in the statistics that outputs may be driven from now on, or may not.

        `generation` is the guard's last takeover that is known where this is decided.
        """
        self._ledger.arm(armed=armed, generation=generation)
        if self._tap is not None:
            self._tap.arm(armed=armed)

    def request_stop(self, reason: str, state: RunState = RunState.STOPPED) -> None:
        """End the run after the step under way; safe in a signal handler and in any thread."""
        if self._stop is None:
            self._stop = Outcome(state, reason)
        self.inbox.wake()

    @property
    def stopped_by(self) -> str | None:
        """What the run was asked to stop for, such as a signal's name; None if it was not."""
        stop = self._stop
        return stop.reason if stop is not None and stop.state is RunState.STOPPED else None

    def give_up(self) -> None:
        """Switch outputs off once at the end, and not again if that fails; safe as above."""
        self._ending.give_up()

    def run(self, until: int = NEVER) -> Outcome:
        """Run up to and including instant `until`; when it returns, outputs have been made safe.

        An error is in the outcome, not raised; only SystemExit and its like go on to the caller.
        """
        if self._has_begun:
            raise RuntimeError("executive: a run cannot be repeated; expected a new executive")
        return self._run_to(until, pauses=False)

    def run_on(self, until: int) -> Outcome:
        """Run up to and including instant `until` and pause there; again, go on to a later one.

        Outputs stay as they are, and only `end` makes them safe. A run that does not reach `until`
        has ended, as by `run`. The outcome is what it would be if the run ended now.
        """
        if self.is_over:
            raise RuntimeError("executive: the run is over; expected a new executive")
        return self._run_to(until, pauses=True)

    def end(self) -> Outcome | None:
        """End a run that is paused, as `run` does; None if it has not begun or is over."""
        if self._paused is None:
            return None
        outcome, self._paused = self._paused, None
        self.clock.start(self.reached)
        return self._end(outcome)

    def add_source(self, source: AnySource) -> None:
        """Wait for one more source, beside those of the configuration; before the run."""
        self._arrivals.add_source(source)

    def poll_by(self, at: int) -> None:
        """Let the hooks be called at instant `at` of the run at the latest; for a hook to call.

        It holds until they are called next, whenever that is.
        """
        self._poll_by = min(self._poll_by, at)

    def plan(self, at: int, port: InPort[T], value: T) -> None:
        """Let a value arrive at an input port of the root at instant `at` of the run."""
        self._arrivals.plan(at, port, value)

    def _run_to(self, until: int, *, pauses: bool) -> Outcome:
        configuration = self._configuration
        with process.in_force(configuration.process, self.clock) as granted:
            if granted["freeze_garbage"].granted:
                self._collector = SlackCollector(self.clock.now)
            try:
                self._granted = granted
                if not self._has_begun:
                    self._has_begun = True
                    end = NEVER if pauses else until
                    self._ledger = self._open_ledger(granted, end, configuration.statistics_path)
                if self._tap is not None:  # makes its file: that is no usual step's time
                    self._tap.go_on(until)
                self._ledger.go_on(until)
                self._paused = None
                with self._profiler.garbage.measured():
                    outcome = self._loop(until)
            except BaseException as error:  # noqa: BLE001 -- whatever it is, outputs come first
                outcome = Outcome.of_error(error)
            if pauses and outcome.state is RunState.ENDED:
                return self._pause(outcome)
            outcome = self._end(outcome)
        if outcome.error is not None and not isinstance(outcome.error, Exception):
            raise outcome.error
        return outcome

    # The loop -----------------------------------------------------------------------------------

    def _loop(self, until: int) -> Outcome:
        accounting, progress = self._profiler.accounting, self.progress
        self.clock.start(self.reached)
        if self.reached == 0 and self._configuration.armed_at_start:
            self.arm(armed=True, generation=0)
        at = self._next_at()
        while accounting.overrun == "" and progress.livelock == "":
            due = min(at, until)
            self._use_slack(due)
            ready = self.clock.wait(min(due, self._poll_by), self._arrivals.sources)
            now = self.clock.now()
            # from here to the first function of a model every microsecond is lateness
            if ready:
                self._arrivals.receive(ready, now)
                at = self._next_at()
            if self._stop is not None:
                return self._stop
            if accounting.has_limits and accounting.is_overdue(min(now, until)):
                break
            if at <= now and at <= until and at != NEVER:
                at = self._work_off(at)
            elif now >= until:
                return Outcome.reached(until)
            else:
                self._ledger.idle(now)
        return Outcome(RunState.OVERRUN, accounting.overrun or progress.livelock)

    def _next_at(self) -> int:
        """The instant of the next internal event or input, whichever comes first."""
        return min(self.simulator.next_at, self._arrivals.next_at(self.simulator.now))

    def _use_slack(self, until: int) -> None:
        """Do what is better done now than in a step."""
        self._poll_by = NEVER
        for hook in self.hooks:
            now = self.clock.now()
            hook.between_steps(now, until - now)
        if self.readiness.waiting:
            self.readiness.poll()
        if self._collector is not None:
            self._collector.offer(min(until, self._poll_by) - self.clock.now())

    def _work_off(self, at: int) -> int:
        """One step: everything that happens at instant `at`, then its entries in the ledger.

        Returns when the next event is due.
        """
        step, tap = self._profiler.step, self._tap
        if tap is not None:
            tap.begin(at)
        step.begin(at)
        self.world_now.begin(at, step.started)
        try:
            for port, value in self._arrivals.take(at):
                if tap is not None:  # first: a value that the port refuses ends the run
                    tap.entered(port, value)
                self.simulator.inject(port, value)
            self.simulator.advance(at)
        finally:
            next_at = self._ledger.commit(step.now(), self._next_at)
        return next_at

    # Before it and after it ---------------------------------------------------------------------

    def _open_ledger(self, granted: Settings, until: int, path: Path | None = None) -> Ledger:
        """A ledger in the file at `path`, or in memory; its header says what holds from now on."""
        conditions = process.run_conditions(self.clock, granted, self._configuration.conditions)
        header = {"clock_speed": self.clock.speed, "until_ns": until, "conditions": conditions}
        file = self._profiler.open_file(header, path)
        return Ledger(file, self._profiler, self.inbox, self.clock, self.progress)

    def _pause(self, outcome: Outcome) -> Outcome:
        """Keep everything as it is until the run goes on or is ended."""
        self.reached = self._ended_at()
        self._ledger.pause(self.reached)
        self._paused = outcome
        return self.readiness.judged(outcome)

    def _ended_at(self) -> int:
        """The present instant; that of the last event where virtual time waited for nothing."""
        if self.clock.now() == NEVER:
            self.clock.start(self.simulator.now)
        return self.clock.now()

    def _end(self, outcome: Outcome) -> Outcome:
        """Make the outputs safe, let the models exit, close the ledger; collect what goes wrong."""
        self.is_over = True
        self.reached = now = self._ended_at()
        outcome = self._ending(outcome)
        self._ledger.finish(outcome.state, now, outcome.reason)
        if self._tap is not None:
            self._tap.finish(outcome, now)
        return outcome

    def _go_on_ending(self, now: int) -> None:
        """Let the world go on, and show that the loop is alive, while it still switches off."""
        self.world_now.begin(now, now)
        self._ledger.idle(self.cells[ELAPSED])  # the run itself is over
