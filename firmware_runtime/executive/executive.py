"""The executive: runs one model against a clock, from what comes before the loop to after the end.

What happens from event to event is the `loop`. The end is always the same: outputs are made safe,
whatever happened, and again while that fails (`outcome`); models exit; statistics say how it ended;
what the system granted is given back. A pause gives that back, leaves outputs and statistics as
they are, and is no time of the run.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from time import monotonic_ns, time_ns
from typing import Any, TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive import process
from firmware_runtime.executive.clocks import Clock, MonotonicClock, WorldClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.garbage import SlackCollector
from firmware_runtime.executive.inbox import AnySource
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.loop import Loop
from firmware_runtime.executive.outcome import Ending, Outcome, SwitchOffRetry
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.statistics.file_header import RunState, Settings, settings_after
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.history import Lately
from firmware_runtime.statistics.layout import YIELDED, Layout
from firmware_runtime.statistics.statistics import Statistics

T = TypeVar("T")

DEFAULT = Configuration()


class Executive:
    """Runs one model, once.

    `make_safe` puts the outputs into their safe state and returns what failed, one sentence each;
    it may be left out for a model that drives nothing.
    `inbox` takes values for the root's input ports from anywhere in the process; `poll_by` is for
    `hooks` that are to be called by some instant; `world_now` is the time of the lines and of a
    world that lives in the process. Raises ConfigError when policies or deadlines
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
        self.world_now = WorldClock() if world_now is None else world_now
        self._profiler = profiler = Profiler(
            root, clock.now, configuration, stands_still=clock.speed == 0
        )
        self.simulator = profiler.simulator
        self.accounts = profiler.accounting.accounts
        self.faults = profiler.faults
        self.world_now.tolerance = profiler.accounting.tolerance
        self._loop = loop = Loop(profiler, clock, self.world_now, configuration)
        self.inbox = loop.inbox
        self.hooks = loop.hooks
        self.poll_by = loop.poll_by
        self.readiness = loop.readiness
        self.progress = loop.progress
        self._configuration = configuration
        self._tap = configuration.tap
        self._ending = self._open_ending(make_safe)
        self._granted: Settings = {}
        self._ledger = self._open_ledger({"clock": type(clock).__name__}, NEVER)
        self._paused: Outcome | None = None
        self.reached = 0
        """The instant at which the run paused or ended, ns; 0 before."""
        self.is_over = False
        """Whether the run has ended; one that is paused has not."""
        self.has_begun = False

    @property
    def statistics(self) -> Statistics:
        """What has been counted so far."""
        return self._ledger.statistics()

    def lately(self, since: int) -> Lately:
        """What became of activations since then, or up to a second before; costs little."""
        return self._ledger.lately(since)

    @property
    def granted(self) -> Settings:
        """The system settings requested, each granted or why not; empty before the run began."""
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
    def state(self) -> dict[str, object]:
        """What it schedules and counts by, by name; inputs that have not arrived are none of it."""
        return {**self._profiler.state, "progress": self.progress, "ledger": self._ledger}

    def arm(self, *, armed: bool, epoch: int) -> None:
        """Note in the statistics that outputs may be driven from now on, or may not.

        `epoch` is the latest that is known where this is decided, see `runs.watched_run`.
        """
        self._ledger.arm(armed=armed, epoch=epoch)
        if self._tap is not None:
            self._tap.arm(armed=armed)

    def request_stop(self, reason: str, state: RunState = RunState.STOPPED) -> None:
        """End the run after the step under way; safe in a signal handler and in any thread."""
        if self._loop.stop is None:
            self._loop.stop = Outcome(state, reason)
        self.inbox.wake()

    @property
    def stopped_by(self) -> str | None:
        """What the run was asked to stop for, such as a signal's name; None if it was not."""
        stop = self._loop.stop
        return stop.reason if stop is not None and stop.state is RunState.STOPPED else None

    def give_up(self) -> None:
        """Switch outputs off once at the end, and not again if that fails; safe as above."""
        self._ending.give_up()

    def run(self, until: int = NEVER) -> Outcome:
        """Run up to and including instant `until`; when it returns, outputs have been made safe.

        An error is in the outcome, not raised; only SystemExit and its like go on to the caller.
        """
        if self.has_begun:
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
        self._loop.arrivals.add_source(source)

    def plan(self, at: int, port: InPort[T], value: T) -> None:
        """Let a value arrive at an input port of the root at instant `at` of the run."""
        self._loop.arrivals.plan(at, port, value)

    # Before the loop and after it -----------------------------------------------------------------

    def _run_to(self, until: int, *, pauses: bool) -> Outcome:
        with process.in_force(self._configuration.process, self.clock) as granted:
            try:
                self._begin(granted, NEVER if pauses else until)
                if self._tap is not None:  # makes its file: that is no usual step's time
                    self._tap.go_on(until)
                self._ledger.go_on(until)
                self._paused = None
                with self._profiler.garbage.measured():
                    self._start_clock()
                    outcome = self._loop.run(until, self._ledger)
            except BaseException as error:  # noqa: BLE001 -- whatever it is, outputs come first
                outcome = Outcome.of_error(error)
            if pauses and outcome.state is RunState.ENDED:
                return self._pause(outcome)
            outcome = self._end(outcome)
        if outcome.error is not None and not isinstance(outcome.error, Exception):
            raise outcome.error
        return outcome

    def _begin(self, granted: Settings, end: int) -> None:
        """Take up what the system has granted; the first time, open the statistics file."""
        if granted["freeze_garbage"].granted:
            self._loop.collector = SlackCollector(self.clock.now)
        self._granted = granted
        if not self.has_begun:
            self.has_begun = True
            stated = self._configuration.conditions
            conditions = process.run_conditions(self.clock, granted, stated)
            self._ledger = self._open_ledger(conditions, end, self._configuration.statistics_path)

    def _start_clock(self) -> None:
        """Go on at the instant that has been reached; a run that begins may be armed."""
        self.clock.start(self.reached)
        if isinstance(self.clock, MonotonicClock):
            self._profiler.step.read_from(*self.clock.source())
        if self.reached == 0 and self._configuration.armed_at_start:
            self.arm(armed=True, epoch=0)

    def _open_ending(self, make_safe: Callable[[], list[str]]) -> Ending:
        """What switches off and lets the models exit, which is recorded if anything is."""
        exit_models, tap = self.simulator.exit, self._tap
        switch_off_for = self._configuration.switch_off_for
        off = SwitchOffRetry(make_safe, self.clock, switch_off_for, self._go_on_ending)
        exits = exit_models if tap is None else partial(tap.exit, exit_models)
        return Ending(exits, self.readiness, off)

    def _open_ledger(
        self, conditions: Mapping[str, Any], until: int, path: Path | None = None
    ) -> Ledger:
        """A ledger in the file at `path`, or in memory; its header says what holds from now on."""
        header = {"clock_speed": self.clock.speed, "until_ns": until, "conditions": conditions}
        if self.clock.speed != 0:  # two runs in virtual time are the same
            header["began"] = monotonic_ns(), time_ns()
        file = self._profiler.open_file(header, path)
        return Ledger(file, self._profiler, self.inbox, self.clock, self.progress)

    def _pause(self, outcome: Outcome) -> Outcome:
        """Keep everything as it is until the run goes on or is ended."""
        self.reached = self._ended_at()
        self._ledger.pause(self.reached)
        self._paused = outcome
        return self.readiness.so_far(outcome)

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
        """Let the world go on while it still switches off.

        It shows no sign of life: what it cannot switch off the guard is to try, which may be able.
        """
        self.world_now.begin(now, now)
        self._ledger.stand_still()
