"""The bias of a gyroscope, measured while the robot rests, and refused when it did not rest."""

import math
from typing import Final

from firmware_drivers.chips.mounting import Vector
from firmware_runtime.hal.wire_errors import NotReady

AXES: Final = "xyz"
PART_BIAS_RAD_S: Final = math.radians(5.0)
"""Zero-rate output that an MPU-9250 may have at 25 degC (PS-MPU-9250A-01 rev. 1.1, table 1)."""
MOST_TURN: Final = 0.02
"""Change of the field from one half to the other, as a share of it, of a robot that rests."""
LEAST_FIELDS: Final = 20
"""In each half, or noise alone may change the mean of the field by so much."""


class GyroBias:
    """Mean rate over `samples` samples, in fixed memory. Rates in rad/s, body axes.

    The limits separate rest from motion: `max_spread` between the smallest and the largest rate of
    an axis, `max_bias` for the mean itself, which catches a robot that turns evenly. It is what the
    part may have by its data sheet; no more, for a greater mean is a turn. A gyro that hides a turn
    is contradicted by a magnetometer, whose mean field differs between both halves of the time.
    """

    def __init__(
        self, samples: int, *, max_spread: float = 0.05, max_bias: float = PART_BIAS_RAD_S
    ) -> None:
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
        self._fields = [0, 0]
        self._field_sums = [[0.0] * 3, [0.0] * 3]

    @property
    def is_complete(self) -> bool:
        """True when enough samples were added."""
        return self.count >= self.samples

    def add(self, rate: Vector, field: Vector | None = None) -> None:
        """Take one sample in; `field`, in T, where the magnetometer has a new one."""
        half = 0 if 2 * self.count < self.samples else 1
        self.count += 1
        for axis, value in enumerate(rate):
            self._sums[axis] += value
            self._least[axis] = min(self._least[axis], value)
            self._greatest[axis] = max(self._greatest[axis], value)
        if field is not None:
            self._fields[half] += 1
            for axis, value in enumerate(field):
                self._field_sums[half][axis] += value

    def mean(self) -> Vector:
        """Give the bias. Raises NotReady if samples are missing or the robot moved."""
        if not self.is_complete:
            raise NotReady(f"{self.count} samples", where="gyro bias", expected=self.samples)
        x, y, z = (self._mean_of(axis) for axis in range(3))
        self._check_field()
        return (x, y, z)

    def _mean_of(self, axis: int) -> float:
        spread = self._greatest[axis] - self._least[axis]
        if not spread <= self.max_spread:
            raise NotReady(
                f"rate about {AXES[axis]} spreads over {spread:.3f} rad/s, expected "
                f"{self.max_spread:g} at most; the robot moved",
                where="gyro bias",
            )
        mean = self._sums[axis] / self.count
        if not abs(mean) <= self.max_bias:
            raise NotReady(
                f"mean rate about {AXES[axis]} is {mean:.3f} rad/s, expected "
                f"{self.max_bias:.3g} at most; the robot turns",
                where="gyro bias",
            )
        return mean

    def _check_field(self) -> None:
        """Compare both halves' mean fields. Raises NotReady if they differ beyond noise."""
        first, second = self._fields
        if min(first, second) < LEAST_FIELDS:
            return
        changed = size = 0.0
        for before, after in zip(*self._field_sums, strict=True):
            begun, ended = before / first, after / second
            changed += (ended - begun) * (ended - begun)
            size += begun * begun
        if not changed <= MOST_TURN * MOST_TURN * size:
            share = math.sqrt(changed / size) if size else math.inf
            raise NotReady(
                f"the field changed by {share:.3f} of itself meanwhile, expected "
                f"{MOST_TURN:g} at most; the robot turns, whatever its gyro says",
                where="gyro bias",
            )
