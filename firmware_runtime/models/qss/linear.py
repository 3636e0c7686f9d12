"""Blocks that are exact on segments: gain, weighted sum, and the product of two."""

from abc import abstractmethod
from collections.abc import Sequence

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.models.qss.finite import demand_finite
from firmware_runtime.models.qss.function import Function
from firmware_runtime.models.qss.segment import NANO, ZERO_SEGMENT, Segment


class Exact(Atomic):
    """Answers each new segment at once with its result on the inputs as they are now.

    waiting --in0?--> sending (0) --out!--> waiting
    """

    def __init__(self, name: str, count: int) -> None:
        super().__init__(name)
        if count < 1:
            raise ModelError(f"{self.path}: {count} inputs; expected 1 or more")
        self.inputs = tuple(self.in_port(f"in{number}", Segment) for number in range(count))
        self.out = self.out_port("out", Segment)
        self._segments = [ZERO_SEGMENT] * count
        self._missing = set(range(count))
        self._result = ZERO_SEGMENT

    def output(self) -> None:
        """Send the result."""
        self.out.send(self._result)

    def external(self, elapsed: int) -> None:
        """Take new segments in; answer once every input has one."""
        seconds = elapsed * NANO
        for number, port in enumerate(self.inputs):
            if port:
                self._segments[number] = port[-1]
                self._missing.discard(number)
            elif elapsed != 0:
                self._segments[number] = self._segments[number].after(seconds)
        if self._missing:
            self.passivate()
        else:
            self._result = self._compute(self._segments)
            self.activate("sending")

    @abstractmethod
    def _compute(self, segments: Sequence[Segment]) -> Segment:
        """The result on segments that all begin now."""


class Sum(Exact):
    """The sum of its inputs, each times its weight: `Sum("error", [1.0, -1.0])`."""

    def __init__(self, name: str, weights: Sequence[float]) -> None:
        super().__init__(name, len(weights))
        for weight in weights:
            demand_finite(self.path, weight=weight)
        self.weights = tuple(float(weight) for weight in weights)

    def _compute(self, segments: Sequence[Segment]) -> Segment:
        a = b = c = d = 0.0
        for weight, segment in zip(self.weights, segments, strict=True):
            a += weight * segment[0]
            b += weight * segment[1]
            c += weight * segment[2]
            d += weight * segment[3]
        return Segment(a, b, c, d)


class Gain(Sum):
    """Its input times a factor."""

    def __init__(self, name: str, factor: float) -> None:
        super().__init__(name, [factor])


class Product(Function):
    """The product of two inputs, `in0` and `in1`, cut off after `order` coefficients.

    What is cut off is watched as in any `Function`: the product is sent again before it matters.
    """

    def __init__(self, name: str, *, order: int = 2, tolerance: float = 1e-4) -> None:
        super().__init__(name, "in0 * in1", ["in0", "in1"], order=order, tolerance=tolerance)
