"""Truth that an inertial sensor's double measures: the world's side of an IMU.

A chip may be mounted askew: what the body feels is turned into what the chip feels.
"""

from typing import Protocol, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

__all__ = ["BodyMotion", "Inertia", "InertialTruth", "Vector"]

Vector: TypeAlias = tuple[float, float, float]


class Inertia(Protocol):
    """Truth for accelerometer, gyroscope and thermometer: specific force in m/s2, rad/s, degC.

    A world whose field costs something gives it to the magnetometer alone.
    """

    @property
    def acceleration(self) -> Vector:
        """Specific force in m/s2."""

    @property
    def rate(self) -> Vector:
        """Rate of turn in rad/s."""

    @property
    def temperature_c(self) -> float:
        """Return the die's temperature."""


class BodyMotion(Struct, frozen=True):
    """Acceleration in m/s2 (specific force) and rate in rad/s; body axes, z up."""

    acceleration: Vector
    rate: Vector
    temperature_c: float


class InertialTruth(Struct, frozen=True):
    """Acceleration in m/s2 (specific force), rate in rad/s and field in T; body axes, z up."""

    acceleration: Vector
    rate: Vector
    field: Vector
    temperature_c: float


class ChipAxes:
    """A mounting such as `+y -x +z`: the chip's axes that lie along body x, y and z, in order."""

    def __init__(self, mounting: str) -> None:
        self._from_body: list[tuple[int, float]] = [(0, 1.0), (1, 1.0), (2, 1.0)]
        for body_axis, word in enumerate(mounting.split()):
            sign = -1.0 if word[0] == "-" else 1.0
            self._from_body["xyz".index(word[1])] = (body_axis, sign)
        self.is_identity = self._from_body == [(0, 1.0), (1, 1.0), (2, 1.0)]

    def turn(self, truth: InertialTruth) -> InertialTruth:
        """The same truth in the chip's axes."""
        if self.is_identity:
            return truth
        return replace(
            truth,
            acceleration=self.turn_vector(truth.acceleration),
            rate=self.turn_vector(truth.rate),
            field=self.turn_vector(truth.field),
        )

    def turn_motion(self, motion: BodyMotion) -> BodyMotion:
        """The same motion in the chip's axes."""
        if self.is_identity:
            return motion
        acceleration, rate = self.turn_vector(motion.acceleration), self.turn_vector(motion.rate)
        return BodyMotion(acceleration, rate, motion.temperature_c)

    def turn_vector(self, vector: Vector) -> Vector:
        """One vector in the chip's axes."""
        if self.is_identity:
            return vector
        x, y, z = (sign * vector[axis] for axis, sign in self._from_body)
        return (x, y, z)
