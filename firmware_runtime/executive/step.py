"""One step: the instant being worked off, and what each model has spent in it."""

from collections.abc import Callable

from firmware_runtime.devs.component import Component, below_root


class Step:
    """The instant under way, and what divides its time among the models.

    `at` is the instant of the run it stands for, `started` what the clock read when it began, and
    `lap` what it read when the last model's function returned. The time from one lap to the next is
    the own time of the model whose function returned: the clock is read once a function, and own
    times, one for each model in order of declaration, add up to the time of the step. `began_at` is
    when each model's output function began, the last time it did. `touched` are the models that
    have left something to count after the step, by number. `takes_time` is False where the clock
    stands still during a step and nothing is kept in a file.
    """

    def __init__(self, now: Callable[[], int], *, takes_time: bool = True) -> None:
        self.takes_time = takes_time
        self.at = 0
        self.started = 0
        self.lap = 0
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self.began_at: list[int] = []
        self.touched: list[int] = []
        self.now = now
        self._zeros: list[int] = []

    def join(self, component: Component) -> int:
        """Give a model its place, in order of declaration; return its number."""
        self.paths.append(below_root(component.path))
        for column in (self.own_times, self.began_at, self._zeros):
            column.append(0)
        return len(self.paths) - 1

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.lap = self.started = self.now()
        self.at = at
        self.own_times[:] = self._zeros
