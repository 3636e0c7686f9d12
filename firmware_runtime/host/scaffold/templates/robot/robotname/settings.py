"""The schema of board.toml: what each table holds, and what a value may be."""

from typing import Annotated, Literal

from msgspec import Meta

from firmware_runtime.board.settings import (
    Address,
    BoardSettings,
    Channel,
    NotNegative,
    Positive,
    Seconds,
    Settings,
)


class SonarTable(Settings, frozen=True):
    """The SRF08."""

    bus: str
    address: Address
    period_s: Seconds
    """From ping to ping."""
    max_range_m: Positive


class MotorTable(Settings, frozen=True):
    """The motor on an H-bridge behind a PCA9685."""

    bus: str
    address: Address
    osc_hz: Positive
    """Measured frequency of this chip's oscillator, nominally 25 MHz."""
    frequency_hz: Positive
    pwm_channel: Channel
    in1: Channel
    in2: Channel
    timeout_s: Seconds


class ControllerTable(Settings, frozen=True):
    """The controller."""

    distance_m: Positive
    lost_s: Seconds
    kp: Annotated[NotNegative, Meta(description="Share of full voltage per m from the distance.")]
    ki: Annotated[NotNegative, Meta(description="Share of full voltage per m s.")]
    kd: Annotated[NotNegative, Meta(description="Share of full voltage per m/s.")]
    max_drive: Annotated[float, Meta(gt=0, le=1, description="Share of full voltage, at most.")]


class WorldTable(Settings, frozen=True):
    """The plant model. Not used on the real robot's bus."""

    start_m: Positive
    top_speed_m_s: Positive
    lag_s: Positive


class RobotNameSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["robotname"]
    sonar: SonarTable
    motor: MotorTable
    controller: ControllerTable
    world: WorldTable
