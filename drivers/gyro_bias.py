"""The bias of a gyroscope, measured while the robot rests, and refused when it did not rest."""

from typing import Final

from drivers.chips.mounting import Vector
from firmware_runtime.hal.errors import NotReady

AXES: Final = "xyz"


class GyroBias:
    """Mean rate over `samples` samples, in fixed memory. Rates in rad/s, body axes.

    The limits separate rest from motion: `max_spread` between the smallest and the largest rate of
    an axis, `max_bias` for the mean itself, which catches a robot that turns evenly. The part's own
    bias is within 5 degrees/s (0.09 rad/s) by its data sheet.
    """

    def __init__(self, samples: int, *, max_spread: float = 0.05, max_bias: float = 0.35) -> None:
        if samples < 2:
            raise ValueError(f"gyro bias: {samples} samples, expected 2 or more")
        self.samples = samples
        self.max_spread = max_spread
        self.max_bias = max_bias
        self.restart()

    def restart(self) -> None:
        """Forget all samples."""
        self.count = 0
        self._sums = [0.0, 0.0, 0.0]
        self._least = [float("inf")] * 3
        self._greatest = [float("-inf")] * 3

    @property
    def is_complete(self) -> bool:
        """True when enough samples were added."""
        return self.count >= self.samples

    def add(self, rate: Vector) -> None:
        """Take one sample in."""
        self.count += 1
        for axis, value in enumerate(rate):
            self._sums[axis] += value
            self._least[axis] = min(self._least[axis], value)
            self._greatest[axis] = max(self._greatest[axis], value)

    def mean(self) -> Vector:
        """Give the bias. Raises NotReady if samples are missing or the robot moved."""
        if not self.is_complete:
            raise NotReady(f"gyro bias: {self.count} samples, expected {self.samples}")
        x, y, z = (self._mean_of(axis) for axis in range(3))
        return (x, y, z)

    def _mean_of(self, axis: int) -> float:
        spread = self._greatest[axis] - self._least[axis]
        if not spread <= self.max_spread:
            raise NotReady(
                f"gyro bias: rate about {AXES[axis]} spreads over {spread:.3f} rad/s, expected "
                f"{self.max_spread:g} at most; the robot moved"
            )
        mean = self._sums[axis] / self.count
        if not abs(mean) <= self.max_bias:
            raise NotReady(
                f"gyro bias: mean rate about {AXES[axis]} is {mean:.3f} rad/s, expected "
                f"{self.max_bias:g} at most; the robot turns"
            )
        return mean
