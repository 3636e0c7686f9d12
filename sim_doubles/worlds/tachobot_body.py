"""TachoBot's body in numbers: what it is (parameters) and how it moves (state)."""

from typing import Literal, NamedTuple

from firmware_boards.tachobot.plant_settings import WorldSettings

__all__ = ["Mounting", "TachobotParameters", "TachobotState"]

Mounting = Literal["platform", "free"]
"""On the rotating platform only yaw moves; free, hovering on its central propeller, all three."""


class TachobotState(NamedTuple):
    """Position, yaw and their rates, in the axes of the room: x and y level, yaw from x to y."""

    x_m: float
    vx_m_s: float
    y_m: float
    vy_m_s: float
    yaw_rad: float
    yaw_rate_rad_s: float


class TachobotParameters(WorldSettings, frozen=True):
    """The numbers of the plant, as board.toml has them, and how it is mounted."""

    mounting: Mounting = "platform"
