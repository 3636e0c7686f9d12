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
    SecondsOrNone,
    Settings,
)

Angle = Annotated[float, Meta(ge=-3.2, le=3.2)]


class EyesTable(Settings, frozen=True, kw_only=True):
    """The ADS1115 with a photocell at each input: left, right, up, down."""

    bus: str
    address: Address
    driver: Literal["own", "adafruit"] = "own"
    """`adafruit`: that of adafruit-circuitpython-ads1x15, the extra of that name."""
    full_scale_v: Positive
    rate_sps: int
    period_s: Seconds
    dark_v: Positive
    """Mean of the four below which there is no light to follow."""


class ServoTable(Settings, frozen=True):
    """One servo."""

    channel: Channel
    least_rad: Angle
    most_rad: Angle
    least_pulse_us: Positive
    most_pulse_us: Positive
    slew_rad_s: Positive


class ServosTable(Settings, frozen=True):
    """The PCA9685 of both."""

    bus: str
    address: Address
    osc_hz: Positive
    frequency_hz: Positive
    period_s: Seconds
    pan: ServoTable
    tilt: ServoTable


class ControllerTable(Settings, frozen=True):
    """Both PIDs: from the difference of two photocells, -1 to 1, to a rate."""

    kp: NotNegative
    ki: NotNegative
    kd: NotNegative
    most_rad_s: Positive
    lost_s: Seconds
    sweep_rad_s: Positive


class WorldTable(Settings, frozen=True):
    """The light. Not used on the real robot's bus."""

    azimuth_rad: Angle
    """Positive to the left of straight ahead."""
    elevation_rad: Angle
    swing_rad: NotNegative
    swing_s: Positive
    shines_from_s: SecondsOrNone
    shines_until_s: SecondsOrNone


class PanTiltSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["pan_tilt"]
    eyes: EyesTable
    servos: ServosTable
    controller: ControllerTable
    world: WorldTable
