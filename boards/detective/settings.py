"""The schema of the detective robot's board.toml. Units are in the keys, or named here."""

from typing import Annotated, Literal

from msgspec import Meta

from firmware_runtime.board.settings import (
    Address,
    BoardSettings,
    Channel,
    NotNegative,
    PortSettings,
    Positive,
    Seconds,
    SecondsOrNone,
    Settings,
)
from firmware_runtime.board.variants import only

Share = Annotated[float, Meta(gt=0, le=1)]


class SonarTable(Settings, frozen=True):
    """One sonar: an SRF08 on I2C or a MaxBotix on a serial port."""

    chip: Literal["srf08", "maxbotix"]
    period_s: Seconds
    """From ping to ping."""
    threshold_m: Positive
    """An echo from here or nearer is a detection."""
    only_entering: bool = False
    """A detection is only what was not there, or farther, at the ping before."""
    bus: Annotated[str | None, only("chip", "srf08")] = None
    address: Annotated[Address | None, only("chip", "srf08")] = None
    max_range_m: Annotated[Positive, only("chip", "srf08")] = 3.0
    gain: Annotated[int, Meta(ge=0, le=31), only("chip", "srf08")] = 31
    port: Annotated[str | None, only("chip", "maxbotix")] = None
    family: Annotated[Literal["lv", "xl", "hrlv"], only("chip", "maxbotix")] = "xl"


class CompassTable(Settings, frozen=True):
    """One compass, both of I2C: a CMPS12 (or CMPS14), or an HMC5883L at its one address."""

    chip: Literal["cmps12", "hmc5883l"]
    bus: str
    period_s: Seconds
    address: Annotated[Address | None, only("chip", "cmps12")] = None
    counterclockwise: bool = False
    """Headings grow to the left, as those of a compass mounted upside down do."""
    offset_deg: float = 0.0
    stuck_after: Annotated[int, Meta(ge=2)] = 50
    """Readings in a row without any change that count as a compass that hangs."""


class TreadsTable(Settings, frozen=True):
    """The treads' driver: an MD25 on I2C or a Sabertooth on a serial port."""

    driver: Literal["md25", "sabertooth"]
    speed: Share
    """Share of full speed that signals 1 and 2 stand for."""
    refresh_s: Seconds
    """The last speeds are sent again this often while moving."""
    bus: Annotated[str | None, only("driver", "md25")] = None
    address: int | None = None
    acceleration: Annotated[int, Meta(ge=1, le=10), only("driver", "md25")] = 5
    """MD25: speed steps (of 127) every 25 ms."""
    port: Annotated[str | None, only("driver", "sabertooth")] = None
    timeout_s: Annotated[Seconds, only("driver", "sabertooth")] = 0.3
    """Sabertooth: silence after which it stops by itself, in whole tenths."""
    left_reversed: bool = False
    right_reversed: bool = False


class RadarMotorTable(Settings, frozen=True):
    """The radar's motor on an H-bridge behind a PCA9685."""

    bus: str
    address: Address
    osc_hz: Positive
    frequency_hz: Positive
    pwm_channel: Channel
    in1: Channel
    in2: Channel
    duty: Share
    longest_turn_s: Seconds
    """The head is stopped when no order came for so long: no chip here would stop it."""


class ModelTable(Settings, frozen=True):
    """What the paper leaves open, as event files run it; see README.md."""

    hop_s: SecondsOrNone
    half_sweep_s: Seconds
    tolerance_deg: NotNegative


class MissionTable(Settings, frozen=True):
    """What the model's parameters are on a robot, when it starts, and when hardware has failed."""

    half_sweep_s: Seconds
    tolerance_deg: NotNegative
    start_s: SecondsOrNone
    faults: Annotated[int, Meta(ge=1)]
    """Faults of one device in a row that count as its failure."""
    on_failure: Literal["end", "wait"]
    """`end`: treads and radar stop and the run ends. `wait`: they stop and stay stopped."""
    longest_s: Seconds = 220.0
    """A mission that has not reached its target after so long has failed."""


class ArenaTable(Settings, frozen=True):
    """The world behind the doubles. Not used on the real robot's lines."""

    target: tuple[float, float]
    target_radius_m: Positive
    obstacles: tuple[tuple[float, float, float], ...]
    walls: tuple[tuple[float, float, float, float], ...]
    start: tuple[float, float]
    start_bearing_deg: float
    wheel_radius_m: Positive
    track_width_m: Positive
    body_radius_m: Positive
    right_slip: NotNegative
    left_slip: NotNegative
    slip_std: NotNegative
    head_speed_deg_s: Positive
    head_limit_deg: NotNegative
    head_start_deg: float
    radar_half_angle_deg: Positive
    body_half_angle_deg: Positive
    sonar_nearest_m: NotNegative
    sonar_farthest_m: Positive
    compass_mounting: Literal["inverted", "upright"]
    compass_noise_deg: NotNegative
    radar_compass_offset_deg: float
    body_compass_offset_deg: float
    seed: Annotated[int, Meta(ge=0)]
    radar_compass_stuck_s: SecondsOrNone | None = None
    body_compass_stuck_s: SecondsOrNone | None = None


class DetectiveSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["detective"]
    model: ModelTable
    mission: MissionTable
    radar_sonar: SonarTable
    body_sonar: SonarTable
    radar_compass: CompassTable
    body_compass: CompassTable
    radar_motor: RadarMotorTable
    treads: TreadsTable
    world: ArenaTable
    ports: dict[str, PortSettings] = {}
