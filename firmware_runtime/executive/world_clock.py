"""The time of the lines and of the world behind them, within a step and from step to step."""

from collections.abc import Callable


class WorldClock:
    """Time of a world that lives in this process: register doubles, and the plant; call it.

    A step that starts on time, within `tolerance`, happens at its logical instant: the world then
    moves by exact periods, and a run in real time gives the values of a run in virtual time. A
    late one happens when it really started. Within a step time goes on by what transactions take on
    the wire (`reach`), and it never goes back: a step begins at its instant, or where the world is.
    `step_at` is the logical instant of the step under way.
    """

    def __init__(self, tolerance: int = 0) -> None:
        self.tolerance = tolerance
        self.step_at = 0
        self._now = 0

    def begin(self, at: int, started: int) -> None:
        """A step for instant `at` starts at `started`."""
        self.step_at = at
        instant = at if started - at <= self.tolerance else started
        if instant > self._now:
            self._now = instant

    def __call__(self) -> int:
        """Return the world's present instant, in ns since the start of the run."""
        return self._now

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""
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

    def begin(self, at: int, started: int) -> None:  # noqa: ARG002 -- real time goes by itself
        """A step for instant `at` starts."""
        self.step_at = at
        self._has_begun = True

    def __call__(self) -> int:
        """Return the present instant, in ns since the start of the run."""
        return max(self._now, self._clock_now()) if self._has_begun else self._now
