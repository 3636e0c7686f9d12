"""The recorder: hears what enters a run, and writes it into the ring between two steps.

Within a step something that is heard costs an `append`. When the step is over, what was heard
becomes one section (`section`), which is copied into shared memory. No system call is made and
nothing is waited for.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, Protocol, TypeVar

from firmware_runtime.blackbox.heard import Heard
from firmware_runtime.blackbox.lines import HeardBus, HeardPort, HeardTime, heard_interlock
from firmware_runtime.blackbox.models import heard_world, listen
from firmware_runtime.blackbox.ring import Ring, SectionTooLarge
from firmware_runtime.blackbox.section import Kind, encode, encode_at_once, legible, sentences
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.errors import text_of
from firmware_runtime.executive.clocks import Clock, VirtualClock, heard_clock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import Interlock
from firmware_runtime.hal.line_time import LineTime
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.recording.chance import places
from firmware_runtime.recording.values import UnknownValue, plain

T = TypeVar("T")

_STEP: Final = Kind.STEP
KEYFRAME_EVERY: Final = 5 * SECOND
KEYFRAME_AGAIN: Final = SECOND // 2
"""Ns until a keyframe is tried again that could not be taken."""
RESERVE: Final = 200 * MICROSECOND
"""Ns to the next event without which no keyframe is taken, beside twice the longest so far."""


class Keyframes(Protocol):
    """The state of the whole robot; `blackbox.keyframes` has it."""

    def capture(self) -> bytes:
        """All of it, now."""


class Recorder:
    """The tap of a run's loop and lines, and a hook of its executive.

    It hears from construction on, and writes once the run begins. `fault` says why something is
    missing in the recording.
    """

    def __init__(self, clock: Clock) -> None:
        self.lines: list[str] = []
        self.early: list[str] = []
        self.own: frozenset[Atomic] = frozenset()
        """The robot's own models; others belong to a world."""
        self.heard = Heard()
        self.fault: str | None = None
        self.written = 0
        """Bytes of sections so far."""
        self.no_keyframe: str | None = None
        """Why the last keyframe that was due could not be taken; a chip may be coming up."""
        self._clock = clock
        self._now = clock.now
        self._places = places()
        self._ring: Ring | None = None
        self._make_ring: Callable[[], Ring | None] | None = None
        self._early: list[bytes] = []
        """Sections from before there was a ring."""
        self._step_at = -1
        """Instant of the step that has not been written; -1: there is none."""
        self._is_real_time = True
        self._is_given_up = False
        self._is_armed: bool | None = None
        self._keyframes: Keyframes | None = None
        self._make_keyframes: Callable[[], Keyframes] | None = None
        self._keyframe_at = 0
        self._longest = 0
        self._counts: Callable[[], object] = dict

    # What is heard ------------------------------------------------------------------------------

    def bus(self, bus: I2cBus) -> I2cBus:
        """A bus, heard."""
        self.lines.append(bus.name)
        if bus.returns_early:
            self.early.append(bus.name)
        return HeardBus(bus, len(self.lines) - 1, self.heard.transfers.append, self._now)

    def port(self, port: SerialPort) -> SerialPort:
        """A serial port, heard."""
        self.lines.append(port.name)
        return HeardPort(port, len(self.lines) - 1, self.heard.transfers.append, self._now)

    def time(self, time: LineTime) -> LineTime:
        """The time of the lines, heard."""
        return HeardTime(time, self.heard.times.append)

    def interlock(self, interlock: Interlock) -> Interlock:
        """An output interlock, heard."""
        return heard_interlock(interlock, self.heard.enabled.append)

    def reading(self, now: Callable[[], int]) -> Callable[[], int]:
        """The clock as the steps ask it, heard."""
        clock, hear = self._clock, self.heard.readings.append
        if isinstance(clock, VirtualClock):  # it stands still within a step
            return now
        return heard_clock(clock, hear)

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """A model of the robot's as it is, one of a world heard."""
        return functions if atomic in self.own else heard_world(atomic, functions, self.heard)

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
        self._make_keyframes = keyframes
        self._counts = counts
        self._is_real_time = is_real_time
        listen(atomics, self.heard.sent.append)

    def built(self) -> None:
        """The robot has been put together."""
        self._write(Kind.BUILD, 0, self._places)

    def _open(self, make_ring: Callable[[], Ring | None]) -> None:
        """Make the ring, and write what was heard before; without one hear nothing more."""
        self._ring = make_ring()
        self._is_given_up = self._ring is None
        for content in self._early:
            self._write_early(content)
        self._early.clear()

    def _write_early(self, content: bytes) -> None:
        if self._ring is None:
            return
        try:
            self._ring.write(content)
        except SectionTooLarge as error:
            self._give_up_section(self._ring, Kind.BUILD, 0, error)
        except OSError as error:
            self._give_up(error)

    def close(self) -> None:
        """Write no more; the recording stays where it is."""
        if self._ring is not None:
            self._flush()
            self._ring.close()
            self._ring = None
            self._is_given_up = True

    @contextmanager
    def section(self, kind: Kind, extra: object = None) -> Iterator[None]:
        """What is heard within the block, between two steps, is a section of its own."""
        self._flush()
        at = self._now()
        try:
            yield
        finally:
            self._write(kind, at, extra)

    def note(self, kind: Kind, extra: object) -> None:
        """Write a section in which nothing was heard."""
        with self.section(kind, extra):
            pass

    def retuned(self, settings: object) -> None:
        """The robot has been given these gains and limits, between two steps."""
        try:
            self.note(Kind.RETUNED, plain(settings))
        except UnknownValue as error:
            self.fault = self.fault or str(error)

    # The loop's tap -----------------------------------------------------------------------------

    def begin(self, at: int) -> None:
        """A step for instant `at` begins."""
        heard = self.heard
        if heard.transfers or heard.enabled or heard.times or self._step_at >= 0:
            self._flush()
        self._step_at = at

    def entered(self, port: InPort[Any], value: object) -> None:
        """A value enters the step that has begun."""
        try:
            self.heard.entered.append((port.name, plain(value)))
        except UnknownValue as error:
            self.fault = self.fault or f"{port.path}: {error}"

    def go_on(self, until: int) -> None:
        """The run begins or goes on, to instant `until`."""
        self._flush()
        if self._make_ring is not None:
            self._open(self._make_ring)
            self._make_ring = None
        self._write(Kind.GO_ON, until)
        if self._make_keyframes is not None:
            self._keyframes, self._make_keyframes = self._able(self._make_keyframes), None

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
            self._write(Kind.EXIT, at, said)
        return errors

    @property
    def before_the_run(self) -> list[bytes]:
        """The sections from before there was a ring, until the run begins."""
        return self._early

    def finish(self, outcome: Outcome, at: int) -> None:
        """The run is over."""
        ended = {"state": outcome.state.name.lower(), "reason": legible(outcome.reason)}
        missing = {"fault": self.fault, "no_keyframe": self.no_keyframe}
        self._write(Kind.ENDED, at, {**ended, **missing, "counts": self._counts()})

    @property
    def warning(self) -> str | None:
        """Why the run cannot be replayed as a whole, or not at all; None if it can."""
        if self.fault is not None or self._ring is None or self.no_keyframe is None:
            return self.fault
        if self._ring.has_wrapped:
            return f"its start has been written over, and it has no keyframe: {self.no_keyframe}"
        return None

    # The executive's hook -----------------------------------------------------------------------

    def between_steps(self, now: int, left: int) -> None:
        """Write the step that is over; take a keyframe if one is due and there is time for it."""
        if self._step_at >= 0:
            self._write(_STEP, self._step_at)
        if (
            now >= self._keyframe_at
            and self._keyframes is not None
            and (left >= 2 * self._longest + RESERVE or not self._is_real_time)
        ):
            self._take_keyframe(self._keyframes, now)

    def _take_keyframe(self, keyframes: Keyframes, now: int) -> None:
        begun = self._now()
        self._keyframe_at = now + KEYFRAME_AGAIN
        state = self._able(keyframes.capture)
        if state is None:
            return
        self.no_keyframe = None
        self._write(Kind.KEYFRAME, now, state)
        self._longest = max(self._longest, self._now() - begun)
        self._keyframe_at = now + KEYFRAME_EVERY

    def _able(self, function: Callable[[], T]) -> T | None:
        """What a function returns; None if the robot's state cannot be kept as it is now."""
        try:
            return function()
        except Exception as error:  # noqa: BLE001 -- the run goes on without a keyframe
            self.no_keyframe = text_of(error)
            return None

    # ---------------------------------------------------------------------------------------------

    def _flush(self) -> None:
        """Write what was heard so far: the step that is over, or something outside of any."""
        if self._step_at >= 0:
            self._write(Kind.STEP, self._step_at)
        elif self.heard:
            self._write(Kind.OUTSIDE, self._now())

    def _write(self, kind: Kind, at: int, extra: object = None) -> None:
        self._step_at = -1
        heard, ring = self.heard, self._ring
        if self._is_given_up:
            heard.clear()
            return
        fields = heard.fields
        fields[0], fields[1], fields[-1] = kind, at, extra
        try:
            content = encode_at_once(fields)
        except Exception:  # noqa: BLE001 -- the run goes on, whatever entered it
            content = self._encoded_with_care(kind, at)
        heard.clear()
        self.written += len(content)
        if ring is None:
            self._early.append(content)
            return
        try:
            is_first = ring.write(content)
        except SectionTooLarge as error:
            self._give_up_section(ring, kind, at, error)
        except OSError as error:
            self._give_up(error)
        else:
            if is_first:
                self._keyframe_at = 0  # each chunk can be replayed on its own

    def _encoded_with_care(self, kind: Kind, at: int) -> bytes:
        """A section with something in it that cannot be written; what is lost is said."""
        try:
            return encode(self.heard.fields)
        except Exception as error:  # noqa: BLE001 -- as above
            self._keyframe_at = min(self._keyframe_at, at + KEYFRAME_AGAIN)
            return _lost(kind, at, error)

    def _give_up_section(self, ring: Ring, kind: Kind, at: int, error: Exception) -> None:
        """Say that a section is missing; what follows is replayed from the next keyframe."""
        if kind is Kind.KEYFRAME:
            self.no_keyframe = text_of(error)
            return
        self._keyframe_at = min(self._keyframe_at, at + KEYFRAME_AGAIN)
        try:
            ring.write(_lost(kind, at, error))
        except OSError as full:
            self._give_up(full)

    def _give_up(self, error: OSError) -> None:
        """Record no more; what has been written stays."""
        self.fault = f"the recording ends before the run does ({error.strerror})"
        if self._ring is not None:
            self._ring.close()
        self._ring = None
        self._is_given_up = True


def _lost(kind: Kind, at: int, error: Exception) -> bytes:
    """What stands in the place of a section that cannot be written."""
    why = legible(f"{kind.name.lower()}: {text_of(error)}")
    return encode((Kind.LOST, at, [], [], [], [], [], [], [], why))
