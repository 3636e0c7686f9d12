"""Outputs of a chip, of which some are broken: what a load sees of what the chip commands.

A kind of fault (`firmware_runtime.hal.strike`) breaks one output: `ignored` stays as it was, `weak`
acts with half of what is commanded, `dead` with nothing, `full-on` with all there is. The chip
knows nothing of it: its registers read as they were written.
"""

from collections.abc import Sequence
from typing import Protocol, TypeVar, runtime_checkable

T = TypeVar("T", int, float)


@runtime_checkable
class HasOutputs(Protocol):
    """A double whose outputs can be broken."""

    def break_output(self, kind: str, number: int) -> None:
        """Break one output: `number` counts round those that are on now, or all where none is."""

    def heal_outputs(self) -> None:
        """Let all outputs follow the chip again."""


class BrokenOutputs:
    """The outputs that are broken, by their index; `full` is what `full-on` stands at."""

    def __init__(self, full: float) -> None:
        self._full = full
        self._broken: dict[int, tuple[str, float]] = {}

    def add(self, kind: str, number: int, now: Sequence[float]) -> None:
        """Break one more; `now` is how all of them stand."""
        on = [index for index, value in enumerate(now) if value] or range(len(now))
        index = on[number % len(on)]
        self._broken[index] = kind, now[index]

    def applied(self, commanded: tuple[T, ...]) -> tuple[T, ...]:
        """Return how the outputs stand for what is commanded."""
        found = list(commanded)
        for index, (kind, before) in self._broken.items():
            found[index] = type(commanded[index])(self._one(kind, before, commanded[index]))
        return tuple(found)

    def _one(self, kind: str, before: float, commanded: float) -> float:
        match kind:
            case "ignored":
                return before
            case "weak":
                return commanded / 2
            case "dead":
                return 0
            case _:
                return self._full
