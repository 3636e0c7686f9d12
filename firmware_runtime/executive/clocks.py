"""Clocks: what a run takes time from. Real, scaled and virtual time are one loop with three clocks.

A clock counts integer nanoseconds since the start of the run and never goes back. The real ones
read CLOCK_MONOTONIC, which no correction of the wall clock can move. They sleep in one `select` for
all sources and for an alarm at the deadline itself, not after the time left: nothing is rounded,
and what passes before the sleep begins does not prolong it. No sleep is longer than `LONGEST_WAIT`:
the loop polls, and shows that it is alive, at least that often.

A world that lives in this process, and the lines to it, have a clock of their own (`WorldClock`).
"""

from collections.abc import Callable, Sequence
from math import inf
from select import select
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.system.this_system import IS_LINUX

if TYPE_CHECKING:
    from firmware_runtime.system.c_library import Alarm

LONGEST_WAIT = 50 * MILLISECOND


class HasDescriptor(Protocol):
    """Something that `select` can wait for."""

    def fileno(self) -> int:
        """The descriptor that becomes readable."""


S = TypeVar("S", bound=HasDescriptor)


class Clock(Protocol):
    """What the loop needs of a clock."""

    @property
    def speed(self) -> float:
        """How many times as fast as CLOCK_MONOTONIC it goes; 0 if only when the loop waits."""

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""

    def now(self) -> int:
        """Return the present instant of the run, in ns."""

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Let time pass to `until` at most; return early with the sources that became readable.

        May also return early with none; the loop then reads the time and waits again.
        """


class MonotonicClock:
    """Real time, from CLOCK_MONOTONIC.

    The last `spin` ns before a deadline are spent polling the clock instead of asleep: closer to
    the deadline than the kernel wakes a sleeper, at the price of the processor time.
    """

    def __init__(self) -> None:
        self.spin = 0
        self.speed: float = 1
        self.overdue_at = 0
        """When the loop last came to a wait that was over already, ns since `start`."""
        self._epoch = monotonic_ns()
        self._alarm = _alarm()

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        self._epoch = monotonic_ns() - at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return monotonic_ns() - self._epoch

    def source(self) -> tuple[Callable[[], int], int]:
        """What to read the time from, and what it reads at instant 0 of the run."""
        return monotonic_ns, self._epoch

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Sleep until the deadline, an input, or the longest wait; then spin if asked to."""
        due = self._monotonic(until)
        wake_at = due - self.spin
        left = wake_at - monotonic_ns()
        if left > LONGEST_WAIT:
            return self._sleep(wake_at - left + LONGEST_WAIT, sources)
        if left > 0:
            ready = self._sleep(wake_at, sources)
        else:
            self.overdue_at = wake_at - left - self._epoch
            ready = select(sources, (), (), 0)[0]
        if self.spin > 0 and not ready:
            while monotonic_ns() < due:
                pass
        return ready

    def _sleep(self, wake_at: int, sources: Sequence[S]) -> list[S]:
        """Sleep until a source is readable, or the instant of CLOCK_MONOTONIC has come."""
        if self._alarm is None:
            return select(sources, (), (), max(wake_at - monotonic_ns(), 0) / SECOND)[0]
        self._alarm.set(wake_at)
        anything: list[Any] = [*sources, self._alarm]
        ready, _, _ = select(anything, (), ())
        if ready[-1] is self._alarm:
            ready.pop()
        return ready

    def _monotonic(self, at: int) -> int:
        """The instant of CLOCK_MONOTONIC, or the first one, at which an instant of the run is."""
        return self._epoch + at


def _alarm() -> "Alarm | None":
    """An alarm, where there is such a thing: elsewhere a sleep ends some microseconds later."""
    if not IS_LINUX:
        return None
    from firmware_runtime.system.c_library import Alarm  # noqa: PLC0415 -- of real time only

    return Alarm()


class ScaledClock(MonotonicClock):
    """Real time, `speed` times as fast: at 10, a run of 30 s takes 3 s.

    Raises ValueError unless `speed` is a positive number.
    """

    def __init__(self, speed: float) -> None:
        super().__init__()
        stated: object = speed
        if not (isinstance(stated, float | int) and 0 < stated < inf):
            raise ValueError(f"scaled clock: speed {speed!r}, expected a positive number")
        self.speed = speed
        self._gained, self._spent = speed.as_integer_ratio()
        self._at = 0

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        super().start(0)
        self._at = at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return self._at + super().now() * self._gained // self._spent

    def source(self) -> tuple[Callable[[], int], int]:
        """What to read the time from, and what it reads at instant 0 of the run."""
        return self.now, 0

    def _monotonic(self, at: int) -> int:
        # rounded up: a deadline is never early
        return self._epoch - (self._at - at) * self._spent // self._gained


class VirtualClock:
    """Virtual time: a wait is over at once, and time stands still while anything is done.

    Never, too, is reached at once: a run without an end is over when nothing is due any more.
    """

    def __init__(self) -> None:
        self.speed: float = 0
        self._now = 0

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        self._now = at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return self._now

    def stall(self, span: int) -> None:
        """Let time pass while the run does nothing, as if it had got no processor time."""
        self._now += span

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Go to `until`, unless a source is readable now."""
        ready: list[S] = []
        if sources:
            ready, _, _ = select(sources, (), (), 0)
        if not ready and until > self._now:
            self._now = until
        return ready


FURTHEST_AHEAD: Final = SECOND // 2
"""Ns that a world may be ahead of the clock: longer than a step's transactions are on the wire."""


class WorldClock:
    """Time of a world that lives in this process: register doubles, and the plant; call it.

    A step that starts on time, within `tolerance`, happens at its logical instant: the world then
    moves by exact periods, and a run in real time gives the values of a run in virtual time. A
    late one happens when it really started. Within a step time goes on by what transactions take on
    the wire (`reach`), and it never goes back: a step begins at its instant, or where the world is.
    It is never further ahead of the clock than FURTHEST_AHEAD: a loop that writes without end in
    one instant takes no more of the world's time than of the machine's. `step_at` is the logical
    instant of the step under way.
    """

    def __init__(self, tolerance: int = 0) -> None:
        self.tolerance = tolerance
        self.step_at = 0
        self._now = 0
        self._furthest = NEVER

    def begin(self, at: int, started: int) -> None:
        """A step for instant `at` starts at `started`."""
        self.step_at = at
        self._furthest = max(at, started) + FURTHEST_AHEAD
        instant = at if started - at <= self.tolerance else started
        if instant > self._now:
            self._now = instant

    def __call__(self) -> int:
        """Return the world's present instant, in ns since the start of the run."""
        return self._now

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past, or too far ahead of the clock."""
        if at > self._furthest:
            at = self._furthest
        if at > self._now:
            self._now = at

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to the present one."""
        return self() - self.step_at


class OutsideClock(WorldClock):
    """Time of chips outside of this process, on a robot or served: real time, by a clock's `now`.

    A transaction takes as long as it takes. Doubles that are served answer at once, yet live as if
    it had lasted as long as its bits: their bus says until when (`reach`). Before the first step
    nothing else passes.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        super().__init__()
        self._clock_now = now
        self._has_begun = False

    def begin(self, at: int, started: int) -> None:
        """A step for instant `at` starts at `started`."""
        self.step_at = at
        self._furthest = max(at, started) + FURTHEST_AHEAD
        self._has_begun = True

    def __call__(self) -> int:
        """Return the present instant, in ns since the start of the run."""
        return max(self._now, self._clock_now()) if self._has_begun else self._now
