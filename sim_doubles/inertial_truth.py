"""What an inertial sensor's double measures: the world's side of an IMU."""

from typing import NamedTuple

__all__ = ["InertialTruth"]


class InertialTruth(NamedTuple):
    """Acceleration in m/s2 (specific force), rate in rad/s and field in T; body axes, z up."""

    acceleration: tuple[float, float, float]
    rate: tuple[float, float, float]
    field: tuple[float, float, float]
    temperature_c: float
