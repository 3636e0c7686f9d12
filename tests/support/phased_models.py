"""Models of several phases a period, and of none, for tests of the accounts."""

from collections.abc import Callable, Sequence

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER


class Phased(Atomic):
    """Goes through its phases again and again: each is a duration, ns; 0 goes on at once.

    `cycles` counts how often it began with the first; `work(number)` is called in each transition.
    """

    def __init__(self, name: str, period: int, phases: Sequence[int], *, begin_at: int = 0) -> None:
        super().__init__(name)
        self.period = period
        self.phases = phases
        self.begin_at = begin_at
        self.transitions = 0
        self.work: Callable[[int], None] = lambda _number: None

    @property
    def cycles(self) -> int:
        """How often it has left its first phase."""
        return -(-self.transitions // len(self.phases))

    def initialize(self) -> None:
        self.hold_in("waiting", self.begin_at)

    def internal(self) -> None:
        self.work(self.transitions)
        number = self.transitions % len(self.phases)
        self.transitions += 1
        self.hold_in(f"phase {number}", self.phases[number])


class Sporadic(Atomic):
    """Answers each input at once, and acts on the latest after `after` ns."""

    def __init__(self, name: str, after: int) -> None:
        super().__init__(name)
        self.after = after
        self.acted: list[int] = []
        self.answered = 0
        self.value = 0
        self.command = self.in_port("command", int)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it forgets what it had booked
        self.value = self.command[-1]
        self.hold_in("answering", 0)

    def internal(self) -> None:
        if self.phase == "answering":
            self.answered += 1
            self.hold_in("acting", self.after)
        else:
            self.acted.append(self.value)
            self.passivate()


FIFTY_HZ = (0, 6 * MILLISECOND, 14 * MILLISECOND)
"""Trigger, at once wait for the conversion, read and sleep for the rest of 20 ms."""
PERIODS = (1_000_003, 1_700_021, 2_300_009, 3_100_007, 4_700_017, 6_100_027)
"""Ns, without a common measure."""


class Board(Coupled):
    """Seven models: six of periods that have nothing in common, each of one to three phases, and a
    sporadic one, fed by the command port."""

    def __init__(self) -> None:
        super().__init__("board")
        self.command = self.in_port("command", int)
        self.periodic = [
            self.add(Phased(f"model_{index}", period, split(period, 1 + index % 3)))
            for index, period in enumerate(PERIODS)
        ]
        self.sporadic = self.add(Sporadic("sporadic", 5 * MILLISECOND))
        self.couple(self.command, self.sporadic.command)


def split(period: int, parts: int) -> tuple[int, ...]:
    """A period in so many phases of different lengths."""
    shares = [period * (index + 1) // (2 * parts * parts) for index in range(parts - 1)]
    return (*shares, period - sum(shares))


def deadlines(first: int, period: int, until: int) -> int:
    """How many a clock sees up to and at `until`: by counting them, not by division."""
    return 0 if first > until or period == NEVER else len(range(first, until + 1, period))
