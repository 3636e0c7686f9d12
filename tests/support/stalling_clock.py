"""A clock for tests of lateness: waiting is over at once, unless a stall was arranged."""

from collections.abc import Callable, Mapping, Sequence
from select import select

from firmware_runtime.executive.clocks import S


class StallingClock:
    """Time moves when the loop waits, by `spend`, and by the stalls.

    `stalls[n]` is how much too late the n-th wait that reaches its deadline returns, counted from
    zero. What is arranged with `at` happens at its instant, whatever the time is passing for.
    """

    def __init__(self, stalls: Mapping[int, int] | None = None) -> None:
        self.speed = 1.0
        self.instant = 0
        self.waits = 0
        self._stalls = stalls or {}
        self._events: list[tuple[int, Callable[[], object]]] = []

    def start(self, at: int) -> None:
        self.instant = at

    def now(self) -> int:
        return self.instant

    def spend(self, span: int) -> None:
        """Let something take time."""
        self._pass_to(self.instant + span)

    def at(self, instant: int, happen: Callable[[], object]) -> None:
        """Arrange something, in order of time."""
        self._events.append((instant, happen))

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        if self._events and self._events[0][0] <= until:
            self._pass_to(self._events[0][0])
        else:
            self._pass_to(max(self.instant, until) + self._stalls.get(self.waits, 0))
            self.waits += 1
        return select(sources, (), (), 0)[0]

    def _pass_to(self, instant: int) -> None:
        reached = max(self.instant, instant)
        while self._events and self._events[0][0] <= reached:
            self.instant, happen = self._events.pop(0)
            happen()
        self.instant = reached
