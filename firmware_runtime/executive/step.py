"""One step: the instant being worked off, and what each model has spent in it."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.functions import Functions


def relative_path(component: Component, root: Component) -> str:
    """The path without the root's name: `controller.yaw`; the root itself goes by its name."""
    return component.path.removeprefix(f"{root.path}.")


class Step:
    """The instant under way, and what divides its time among the models.

    `at` is the instant of the run it stands for, `started` what the clock read when it began, and
    `lap` what it read when the last model's function returned. The time from one lap to the next is
    the own time of the model whose function returned: the clock is read once a function, and own
    times, one for each model in order of declaration, add up to the time of the step. `began_at` is
    when each model's output function began, the last time it did.
    """

    def __init__(self, root: Component, now: Callable[[], int]) -> None:
        self.at = 0
        self.started = 0
        self.lap = 0
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self.began_at: list[int] = []
        self._zeros: list[int] = []
        self._root = root
        self._now = now

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.lap = self.started = self._now()
        self.at = at
        self.own_times[:] = self._zeros

    def watch(self, atomic: Atomic, functions: Functions) -> Functions:
        """Time one model's functions; called once for each model, in order of declaration."""
        number, own_times, began_at, now = (
            len(self.paths),
            self.own_times,
            self.began_at,
            self._now,
        )
        self.paths.append(relative_path(atomic, self._root))
        own_times.append(0)
        self.began_at.append(0)
        self._zeros.append(0)

        def output() -> None:
            began_at[number] = self.lap
            functions.output()
            lap = now()
            own_times[number] += lap - self.lap
            self.lap = lap

        def timed(function: Callable[[], None]) -> Callable[[], None]:
            def call() -> None:
                function()
                lap = now()
                own_times[number] += lap - self.lap
                self.lap = lap

            return call

        def external(elapsed: int) -> None:
            functions.external(elapsed)
            lap = now()
            own_times[number] += lap - self.lap
            self.lap = lap

        confluent = functions.confluent
        return Functions(
            output=output,
            internal=timed(functions.internal),
            external=external,
            confluent=None if confluent is None else timed(confluent),
        )
