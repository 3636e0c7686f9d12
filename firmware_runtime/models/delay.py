"""A pure transport delay as an atomic model: what a network in the loop does to a signal."""

from collections import deque
from typing import Generic, TypeVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import whole

T = TypeVar("T")


def whole_ns(model: Atomic, what: str, duration: object, least: int = 0) -> int:
    """Return a duration that a model is given, in ns. Raises ModelError for what is none."""
    ns = whole(duration)
    if ns is None or ns < least:
        expected = f"whole ns, {least} or more"
        raise ModelError(f"a {what} of {duration!r}", where=model.path, expected=expected)
    return ns


class Delay(Atomic, Generic[T]):
    """Sends every value again `duration` ns after it came, in order; values may overlap.

    passive --in?--> holding (time to the oldest) --out!--> holding | passive
    """

    def __init__(self, name: str, type_: type[T], duration: int) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", type_, takes="any")
        self.delayed = self.out_port("out", type_)
        self.duration = whole_ns(self, "delay", duration)
        self.held: deque[tuple[int, T]] = deque()
        self._age = 0
        """Ns of this model's own time, against which the held values' due times are kept."""

    def output(self) -> None:
        """Send what is due at this instant."""
        due = self.held[0][0]
        for leaves_at, value in self.held:
            if leaves_at != due:
                break
            self.delayed.send(value)

    def internal(self) -> None:
        """Drop what was sent and wait for the next oldest."""
        self._age = self.held[0][0]
        while self.held and self.held[0][0] == self._age:
            self.held.popleft()
        self._wait()

    def external(self, elapsed: int) -> None:
        """Take values in."""
        self._age += elapsed
        self.held.extend((self._age + self.duration, value) for value in self.entrance)
        self._wait()

    def _wait(self) -> None:
        if self.held:
            self.hold_in("holding", self.held[0][0] - self._age)
        else:
            self.passivate()
