"""Signals, which expressions read, and what an expression reads of them at an instant."""

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import format_time
from firmware_runtime.models.qss.program import Layout
from firmware_runtime.models.qss.segment import NANO, Segment


class Signal:
    """A polynomial in time, of three degrees at most, from an instant on."""

    kept: ClassVar = ("coefficients", "at", "is_missing")
    """The attributes that change."""

    def __init__(
        self, name: str, count: int, initial: float | None, way: OutPort[Segment] | None = None
    ) -> None:
        self.name, self.count = name, count
        self.coefficients = [float(initial or 0.0), *[0.0] * (count - 1)]
        self.at = 0
        self.is_missing = initial is None
        self.way = way
        """Where it is sent whenever it is new."""
        self.functions: list[int] = []
        self.events: list[int] = []
        """The numbers of those that read it."""

    def bring(self, now: int) -> Sequence[float]:
        """Let it begin at an instant; its coefficients there."""
        a, seconds = self.coefficients, (now - self.at) * NANO
        self.at = now
        if seconds == 0.0 or self.count == 1:
            return a
        if self.count == 2:
            a[0] += seconds * a[1]
        elif self.count == 3:
            b, c = a[1], a[2]
            a[0] += seconds * (b + seconds * c)
            a[1] = b + 2.0 * seconds * c
        else:
            a[:] = Segment(*a).after(seconds)
        return a

    def segment_at(self, now: int) -> Segment:
        """The same from an instant on; nothing changes by that."""
        return Segment(*self.coefficients).after((now - self.at) * NANO)


class Readings:
    """The signals that an expression reads, and what to say where it has no value."""

    def __init__(
        self,
        path: Callable[[], str],
        tree: ast.expr,
        signals: Sequence[Signal],
        parameters: Mapping[str, float],
    ) -> None:
        self.path, self.text, self.signals = path, ast.unparse(tree), tuple(signals)
        self.layout = Layout({each.name: each.count for each in signals}, parameters)
        """What the expression may read, for its compilation."""

    @property
    def are_missing(self) -> bool:
        """Whether one of them has had no value yet."""
        return any(each.is_missing for each in self.signals)

    @property
    def are_moving(self) -> bool:
        """Whether one of them changes between events."""
        return any(any(each.coefficients[1:]) for each in self.signals)

    def at(self, now: int) -> list[float]:
        """Their coefficients at an instant, one after another, as compiled code takes them."""
        flat: list[float] = []
        for signal in self.signals:
            flat += signal.coefficients if signal.at == now else signal.bring(now)
        return flat

    def no_value(self, now: int, error: Exception) -> ModelError:
        """Where the expression has no value: at which instant, and of what."""
        return ModelError(
            f"{self.text} has no value at {self.shown(now)}: {error}",
            where=self.path(),
            expected="finite real numbers all the way",
        )

    def shown(self, now: int) -> str:
        """An instant, and what was read there."""
        read = (f"{each.name} = {each.coefficients[0]:.6g}" for each in self.signals)
        return ", ".join((format_time(now), *read))
