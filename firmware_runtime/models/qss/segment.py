"""Segments and signals: polynomials in time, on a wire between two events and as they are read."""

import ast
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from numbers import Real
from typing import ClassVar, Final, NamedTuple

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.models.qss.program import Layout

NANO: Final = 1e-9
"""Seconds in a nanosecond."""

LONGEST_S: Final = NEVER / SECOND - 1.0
"""From here on a duration counts as NEVER."""


class Segment(NamedTuple):
    """`value + slope t + half_curvature t^2 + sixth_jerk t^3`, t in seconds since it was sent.

    The units are the signal's, and the signal's by s, s2 and s3. QSS1 sends constants, QSS2 and
    LIQSS2 straight lines, QSS3 parabolas; `sixth_jerk` is set on the wire `state` of a QSS3 only.
    """

    value: float
    slope: float = 0.0
    half_curvature: float = 0.0
    sixth_jerk: float = 0.0

    def at(self, seconds: float) -> float:
        """The value so many seconds after the start."""
        a, b, c, d = self
        return a + seconds * (b + seconds * (c + seconds * d))

    def after(self, seconds: float) -> "Segment":
        """The same polynomial, begun so many seconds later."""
        a, b, c, d = self
        return Segment(
            a + seconds * (b + seconds * (c + seconds * d)),
            b + seconds * (2.0 * c + 3.0 * seconds * d),
            c + 3.0 * seconds * d,
            d,
        )


ZERO_SEGMENT: Final = Segment(0.0)


def whole_after(seconds: float) -> int:
    """The whole ns that span a duration, 1 at least unless it is none; NEVER without an end.

    A duration that is a whole number of ns but for the rounding of a float is that number.
    """
    if seconds >= LONGEST_S:
        return NEVER
    if seconds <= 0.0:
        return 0
    ns = seconds * 1e9
    nearest = round(ns)
    if abs(ns - nearest) <= 1e-14 * ns + 1e-6:
        return max(nearest, 1)
    return int(ns) + 1


def next_instant(now: int, seconds: float) -> int:
    """The instant, in ns, a duration later, 1 ns at least; NEVER without an end."""
    after = max(whole_after(seconds), 1)
    return NEVER if after >= NEVER else now + after


def is_finite(value: object) -> bool:
    """Return whether it is a real number that a float can hold."""
    try:
        return isinstance(value, Real) and isfinite(value)
    except OverflowError:
        return False


def demand_finite(block: str, **numbers: object) -> None:
    """Refuse what is no finite number of a block: in one, it would spoil all that is downstream."""
    for name, value in numbers.items():
        if not is_finite(value):
            raise ModelError(f"{name} is {value!r}", where=block, expected="a finite number")


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
        """True if one of them has had no value yet."""
        return any(each.is_missing for each in self.signals)

    @property
    def are_moving(self) -> bool:
        """True if one of them changes between events."""
        return any(any(each.coefficients[1:]) for each in self.signals)

    def at(self, now: int) -> list[float]:
        """Their coefficients at an instant, one after another, as compiled code takes them."""
        flat: list[float] = []
        for signal in self.signals:
            flat += signal.coefficients if signal.at == now else signal.bring(now)
        return flat

    def no_value(self, now: int, error: Exception) -> ModelError:
        """Return where the expression has no value: at which instant, and of what."""
        return ModelError(
            f"{self.text} has no value at {self.shown(now)}: {error}",
            where=self.path(),
            expected="finite real numbers all the way",
        )

    def shown(self, now: int) -> str:
        """An instant, and what was read there."""
        read = (f"{each.name} = {each.coefficients[0]:.6g}" for each in self.signals)
        return ", ".join((format_time(now), *read))
