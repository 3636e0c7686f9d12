"""The recorder: notes what enters a run, and writes it between two steps.

Within a step each thing recorded costs an `append`. When the step is over, what is pending becomes
one section (`section`), which is copied into shared memory (`writer`).
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from time import monotonic_ns, time_ns
from typing import Any
from zlib import crc32

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import legible, raised_words
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.budget import LineTime
from firmware_runtime.hal.interlock import Interlock, NotedInterlock
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.recording.blackbox.keyframe_schedule import (
    LARGE,
    RESERVE,
    Keyframes,
    KeyframeSchedule,
    KeyframeWarnings,
)
from firmware_runtime.recording.blackbox.ring import Ring
from firmware_runtime.recording.blackbox.section import Kind, encode, sentences
from firmware_runtime.recording.blackbox.state_of_run import begin_late, places
from firmware_runtime.recording.blackbox.steps import EndOfStep, begin_of_step, end_of_step
from firmware_runtime.recording.blackbox.taps import (
    TappedPort,
    TappedTime,
    tap_outputs,
    tapped_interlock,
    tapped_world,
)
from firmware_runtime.recording.blackbox.writer import NO_STEP, Pending, Writer
from firmware_runtime.recording.values import UnknownValue, plain
from firmware_runtime.statistics.file_header import RunState


class Recorder:
    """The tap of a run's loop and lines.

    It notes from construction on, and writes once the run begins.
    """

    def __init__(self, clock: Clock) -> None:
        self.lines: list[str] = []
        self.early: list[str] = []
        self.own: frozenset[Atomic] = frozenset()
        """The robot's own models; others belong to a world."""
        self.pending = Pending()
        self._fault: str | None = None
        self._step = Step(clock.now)
        self._clock = clock
        self._now = clock.now
        self.chance = places()
        begin_late(self.chance)
        """Where the process's generators of random numbers stood before the robot was built."""
        self._schedule = KeyframeSchedule()
        self._warnings = KeyframeWarnings()
        self._writer = Writer(self.pending, self._schedule)
        self._make_ring: Callable[[], Ring | None] | None = None
        self.until = NEVER
        """The instant that the run goes on to, ns."""
        self._is_armed: bool | None = None
        self._counts: Callable[[], object] = dict
        self._has_raised = False
        """Whether a step did not come to its end."""
        self.begin = begin_of_step(self.pending, self._flush)
        """A step begins."""
        self.end: EndOfStep = self._end
        """The step is over: write it; take a keyframe if one is due and there is time for it."""

    # What is tapped -----------------------------------------------------------------------------

    def bus(self, bus: AccountedBus, *, returns_early: bool) -> None:
        """A bus whose transactions are noted, in the order in which buses and ports are opened."""
        bus.record(len(self.lines), self.pending.transfers, self._now)
        self.lines.append(bus.name)
        if returns_early:
            self.early.append(bus.name)

    def port(self, port: SerialPort) -> SerialPort:
        """A serial port, tapped."""
        self.lines.append(port.name)
        return TappedPort(port, len(self.lines) - 1, self.pending.transfers, self._now)

    def time(self, time: LineTime) -> LineTime:
        """The time of the lines, tapped."""
        return TappedTime(time, self.pending.times)

    def interlock(self, interlock: Interlock) -> Interlock:
        """An output interlock, whose answers are noted."""
        if isinstance(interlock, NotedInterlock):
            interlock.answers = self.pending.enabled
            return interlock
        return tapped_interlock(interlock, self.pending.enabled)

    def watch(self, step: Step) -> None:
        """The steps of the run, of which the readings of the clock are noted."""
        self._step = step

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """A model of the robot's as it is, one of a world tapped."""
        return functions if atomic in self.own else tapped_world(atomic, functions, self.pending)

    # Where a run begins and ends ----------------------------------------------------------------

    def write_into(
        self,
        ring: Callable[[], Ring | None],
        atomics: Sequence[Atomic],
        keyframes: Callable[[], Keyframes],
        counts: Callable[[], object],
        *,
        is_real_time: bool,
    ) -> None:
        """Write into a ring as soon as the run begins; the chips have been found.

        `ring` makes it, or returns None where it cannot be made. `keyframes` makes what captures
        the state; `counts` says at the end what became of the models' activations. In virtual time
        a keyframe makes nothing late.
        """
        self._make_ring = ring
        self._schedule.plan(keyframes, is_real_time=is_real_time)
        self._counts = counts
        classes = self.pending.classes
        tap_outputs(atomics, self.pending.sent, unlike=classes.unlike)
        classes.skipped = frozenset(
            port.number
            for atomic in atomics
            if atomic not in self.own
            for port in atomic.out_ports.values()
        )

    def warn(self, log: Callable[[str], None]) -> None:
        """Let `log` get what will keep the run from being replayed, while it goes on."""
        self._warnings.log, self._warnings.largest = log, self._schedule.largest

    def built(self) -> None:
        """The robot has been put together."""
        self._writer.write(Kind.BUILD, 0)

    def close(self) -> None:
        """Write no more; the recording stays where it is."""
        if self._writer.ring is not None:
            self._flush()
            self._writer.close()

    @contextmanager
    def section(self, kind: Kind, extra: object = None) -> Iterator[None]:
        """What is recorded within the block, between two steps, is a section of its own."""
        self._flush()
        at = self._now()
        try:
            yield
        finally:
            self._writer.write(kind, at, extra)

    def note(self, kind: Kind, extra: object) -> None:
        """Write a section that has this `extra` and nothing else."""
        with self.section(kind, extra):
            pass

    def retuned(self, settings: object) -> None:
        """The robot has been given these gains and limits, between two steps."""
        try:
            self.note(Kind.RETUNED, plain(settings))
        except UnknownValue as error:
            self._fault = self._fault or str(error)

    # The loop's tap -----------------------------------------------------------------------------

    def entered(self, port: InPort[Any], value: object) -> None:
        """A value enters the step that has begun."""
        try:
            self.pending.entered.append((port.name, plain(value)))
        except UnknownValue as error:
            self._fault = self._fault or f"{port.path}: {error}"

    def go_on(self, until: int) -> None:
        """The run begins or goes on, to instant `until`."""
        self._flush()
        self.until = until
        if self._make_ring is not None:
            self._writer.open(self._make_ring)
            self._make_ring = None
            if (ring := self._writer.ring) is not None:
                written = self._step, self.pending, ring, self._writer, self._schedule
                self.end = end_of_step(*written, self._take_keyframe, self._fill_ahead)
        self._writer.write(Kind.GO_ON, until)
        self._schedule.open(self._written_nowhere)
        if self._schedule.cannot is not None:
            self._warnings.cannot(self._schedule.cannot)

    def arm(self, *, armed: bool) -> None:
        """Outputs may be driven from now on, or may not; what is so already is not said again."""
        if armed is not self._is_armed:
            self._is_armed = armed
            self.note(Kind.ARMED, armed)

    def exit(self, exit_models: Callable[[], list[Exception]]) -> list[Exception]:
        """Call the models' exit in a section of its own."""
        self._flush()
        at, said = self._now(), list[str]()
        try:
            errors = exit_models()
            said += sentences(errors)
        finally:
            self._writer.write(Kind.EXIT, at, said)
        return errors

    @property
    def is_kept(self) -> bool:
        """Whether the run has been written into a ring."""
        return self._writer.is_kept

    @property
    def before_the_run(self) -> list[bytes]:
        """The sections from before there was a ring, until the run begins."""
        return self._writer.early

    def finish(self, outcome: Outcome, at: int) -> None:
        """The run is over."""
        ended: dict[str, object] = {
            "state": outcome.state.name.lower(),
            "reason": legible(outcome.reason),
        }
        missing: dict[str, object] = {"fault": self._missing, "no_keyframe": self._schedule.fault}
        if outcome.error is not None and outcome.state is RunState.FAILED:
            ended["raised"] = legible(raised_words(outcome.error))
            missing["in_step"] = self._has_raised
        has_begun = self._make_ring is None
        counts = self._counts() if has_begun else {}
        self._writer.write(Kind.ENDED, at, {**ended, **missing, "counts": counts})

    @property
    def warning(self) -> str | None:
        """Why the run cannot be replayed as a whole, or not at all; None if it can."""
        why = self._schedule.fault
        if self._missing is None and why is not None and self._writer.has_wrapped:
            return f"its start has been written over, and it has no keyframe: {why}"
        return self._missing

    @property
    def _missing(self) -> str | None:
        """Why something is missing in the recording."""
        return self._writer.fault or self._fault

    # ---------------------------------------------------------------------------------------------

    def _end(self, at: int, next_at: int) -> None:
        """A step is over that goes into no ring."""
        self._note_readings()
        self._writer.write(Kind.STEP, at)
        if at >= self._schedule.due_at:
            self._take_keyframe(next_at)

    def _written_nowhere(self, state: bytes) -> None:
        """Do what it takes to write a keyframe, but for the bytes in the ring."""
        for kind, extra in (
            (Kind.DATE, [monotonic_ns(), time_ns()]),
            (Kind.KEYFRAME, state),
            (Kind.CLASSES, self.pending.classes.state()),
        ):
            crc32(encode([kind.value, 0, *self.pending.lists, extra]))

    def _take_keyframe(self, next_at: int) -> None:
        """Take one now, if there is time enough until the next step or the end."""
        now, schedule, ring = self._now(), self._schedule, self._writer.ring
        if ring is None:
            return
        if not isinstance(self._clock, VirtualClock):
            self._writer.write(Kind.DATE, now, [monotonic_ns(), time_ns()])
        left = min(next_at, self.until) - now
        if schedule.has_time(now, left) and (state := schedule.capture(now)) is not None:
            is_large = LARGE * len(state) > ring.chunk_size
            self._writer.write(Kind.KEYFRAME, now, state)
            self._writer.write(Kind.CLASSES, now, self.pending.classes.state())
            spent = self._now() - now
            if schedule.fault is None:
                schedule.taken(now, spent, is_large=is_large)
                self._warnings.taken(now, len(state), is_large=is_large)
                return
            schedule.failed(now, spent)  # no chunk has room for it
        self._warnings.missed(now, schedule.fault, is_last_chunk=ring.is_in_last_chunk)

    def _fill_ahead(self, next_at: int) -> None:
        """Take a little more of the ring's space, if there is time enough until the next step."""
        ring = self._writer.ring
        if ring is not None and min(next_at, self.until) - self._now() >= RESERVE:
            with suppress(OSError):  # it is said when the space is needed
                ring.fill_ahead()

    def _flush(self) -> None:
        """Write what is pending: the step that is over, or something outside of any."""
        if (at := self.pending.step_at) != NO_STEP:
            self._has_raised = True
            self._note_readings()
            self._writer.write(Kind.STEP, at)
        elif self.pending:
            self._writer.write(Kind.OUTSIDE, self._now())

    def _note_readings(self) -> None:
        """Note what the clock said in the step; in virtual time, when that began if it was late."""
        step = self._step
        if not step.stands_still:
            self.pending.readings += step.readings()
        elif step.started != step.at:
            self.pending.readings.append(step.started)
