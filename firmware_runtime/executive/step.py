"""One step: the instant being worked off, what the clock said as it was, and why it is late."""

from collections.abc import Callable, Sequence

from msgspec import Struct

from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.devs.functions import Laps


class Step:
    """The instant under way, and what divides its time among the models.

    `at` is the instant of the run it stands for, `started` what the clock read when it began,
    `ended` when it was over. In `laps` the simulator notes what the clock reads when a model's
    function returns: the time from one lap to the next is the own time of that model. So the clock
    is read once a function, and own times, one for each model in order of declaration, add up to
    the time of the step. `began_at` is when each model's output function began, the last time it
    did. Both are known when the step is settled (`accounting`).

    A reading is what is read less `epoch`. Where the clock `stands_still` during a step, nothing is
    read in it.
    """

    def __init__(self, now: Callable[[], int], *, stands_still: bool = False) -> None:
        self.at = 0
        self.started = 0
        self.ended = 0
        self.epoch = 0
        self.laps = Laps(int if stands_still else now)  # `int()` is zero
        self.stands_still = stands_still
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self.began_at: list[int] = []
        self._now = now
        self._zeros: list[int] = []

    def join(self, component: Component) -> int:
        """Give a model its place, in order of declaration; return its number."""
        self.paths.append(below_root(component.path))
        for column in (self.own_times, self.began_at, self._zeros):
            column.append(0)
        return len(self.paths) - 1

    def read_from(self, read: Callable[[], int], epoch: int) -> None:
        """Read the time from there, from now on; it reads `epoch` at instant 0 of the run."""
        self.laps.read, self.epoch = read, epoch

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.at = at
        self.own_times[:] = self._zeros
        self.laps.noted.clear()
        if self.stands_still:
            self.started = self._now()
            self.epoch = -self.started
        else:
            self.started = self.laps.read() - self.epoch

    def readings(self) -> list[int]:
        """What the clock said in the step that is over, in order; instants of the run, ns."""
        epoch = self.epoch
        return [self.started, *[each - epoch for each in self.laps.noted[2::4]], self.ended]


class Late(Struct, frozen=True):
    """What the loop knows of a step that is to be explained; times in ns.

    `behind` and `wake` lie before it, `step` is how long it took, `usual_step` how long one takes.
    It took its models `own_times` and each bus's devices `spent`, it was `beyond` the usual, and
    the run had made so many `steps`.
    """

    ended: int
    behind: int
    wake: int
    step: int
    usual_step: int
    garbage: int
    previous_end: int
    own_times: Sequence[int] = ()
    spent: Sequence[Sequence[int]] = ()
    beyond: int = 0
    steps: int = 0

    @property
    def in_step(self) -> int:
        """What the step took longer than is usual."""
        return max(self.step - self.usual_step, 0)

    @property
    def of(self) -> int:
        """What is to be explained: the lateness, and that."""
        return self.behind + self.wake + self.in_step
