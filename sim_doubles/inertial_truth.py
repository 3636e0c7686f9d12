"""Truth that an inertial sensor's double measures: the world's side of an IMU."""

from typing import Protocol, TypeAlias

from msgspec import Struct

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
