"""One step: the instant being worked off, and what each model has spent in it."""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.functions import Functions


def relative_path(component: Component, root: Component) -> str:
    """The path without the root's name: `controller.yaw`; the root itself goes by its name."""
    return component.path.removeprefix(f"{root.path}.")


class Step:
    """The instant under way, and an instrument that adds up each model's own time in it.

    `at` is the instant of the run it stands for, `started` what the clock read when it began.
    `own_times` has one entry a model, in order of declaration: what its functions took together.
    """

    def __init__(self, root: Component, now: Callable[[], int]) -> None:
        self.at = 0
        self.started = 0
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self._root = root
        self._now = now

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.at = at
        self.own_times[:] = [0] * len(self.own_times)
        self.started = self._now()

    def __call__(self, atomic: Atomic, functions: Functions) -> Functions:
        """Time one model's functions."""
        number, own_times, now = len(self.paths), self.own_times, self._now
        self.paths.append(relative_path(atomic, self._root))
        own_times.append(0)

        def timed(function: Callable[[], None]) -> Callable[[], None]:
            def call() -> None:
                start = now()
                function()
                own_times[number] += now() - start

            return call

        def external(elapsed: int) -> None:
            start = now()
            functions.external(elapsed)
            own_times[number] += now() - start

        confluent = functions.confluent
        return Functions(
            output=timed(functions.output),
            internal=timed(functions.internal),
            external=external,
            confluent=None if confluent is None else timed(confluent),
        )
