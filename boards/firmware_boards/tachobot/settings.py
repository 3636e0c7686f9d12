"""The schema of TachoBot's board.toml. Units are in the keys, or named here where they are not."""

from typing import Annotated, ClassVar, Literal, TypeAlias

from msgspec import Meta

from firmware_boards.tachobot.plant_settings import WorldSettings
from firmware_boards.tachobot.tracking_settings import (
    AnyTrajectory,
    ExternalPositionSettings,
    HoldSettings,
)
from firmware_runtime.board.settings import (
    Address,
    BoardSettings,
    Channel,
    Fraction,
    NotNegative,
    Positive,
    Seconds,
    SecondsOrNone,
    Settings,
)
from firmware_runtime.models.plant import SecondOrderPlant


class ImuSettings(Settings, frozen=True):
    """The MPU-9250."""

    bus: str
    address: Address
    mounting: str
    """Chip axes that point along body x, y and z, such as `+x +y +z`."""
    sample_hz: int
    """Rate at which the chip samples, a divisor of 1000; more than the control rate."""
    bandwidth_hz: int
    """Low-pass filter: 184, 92, 41, 20, 10 or 5."""
    gyro_range_dps: int
    accel_range_g: int
    also_accept: tuple[int, ...]
    """WHO_AM_I values to take beside the known ones."""
    calibration_s: Seconds
    """Time for which the robot stands still while the gyro's bias is measured."""
    still_rad_s: Positive
    """Spread of the rate above which it did not stand still."""
    max_bias_rad_s: Positive
    """Mean rate above which it is taken to turn evenly instead of to rest."""


class ThrustPairsSettings(Settings, frozen=True):
    """The PCA9685 of the eight propellers."""

    bus: str
    address: Address
    osc_hz: Positive
    """Measured frequency of this chip's oscillator, nominally 25 MHz."""
    frequency_hz: Positive
    first_channel: Annotated[int, Meta(ge=0, le=8)]
    slew_per_s: Annotated[
        Positive, Meta(description="Fastest change of a duty, full range per second.")
    ]
    timeout_s: Annotated[
        Seconds,
        Meta(description="Without new forces for this long, all propellers are switched off."),
    ]
    pair_thrust_n: Positive | None = None
    """Full force of a pair; left out: the plant model's `world.pair_thrust_n`."""


class EscSettings(Settings, frozen=True):
    """The PCA9685 of the central propeller's speed controller, and its pulses: mode `free` only."""

    bus: str
    address: Address
    osc_hz: Positive = 25_000_000.0
    frequency_hz: Positive = 50.0
    channel: Channel = 0
    low_pulse_us: Positive = 1000.0
    high_pulse_us: Positive = 2000.0
    arming_s: Seconds = 3.0
    throttle: Fraction = 0.6
    """Throttle that lifts the robot."""


class PidSettings(Settings, frozen=True):
    """One PID; gains in N per m or rad, N per m s or rad s, N s per m or rad."""

    kp: NotNegative
    ki: NotNegative
    kd: NotNegative
    anti_windup: bool


class PositionSettings(PidSettings, frozen=True):
    """The PID of x or y."""

    kp: NotNegative = 1.0
    ki: NotNegative = 0.01
    kd: NotNegative = 2.5
    anti_windup: bool = True
    reference_m: float = 0.0


class SmithSettings(Settings, frozen=True):
    """A Smith predictor before the PID of yaw; numbers left out are those of `[world]`."""

    delay_s: SecondsOrNone
    """The delay of the loop that it is to make up for, both ways together."""
    inertia_kg_m2: Positive | None = None
    damping_nms: NotNegative | None = None
    lag_s: NotNegative | None = None


class WaveSettings(Settings, frozen=True):
    """A square wave to the propellers in place of the PID's command, to see what the robot does."""

    amplitude_n: Positive
    """Amplitude of the yaw command, both ways."""
    period_s: Seconds
    begin_s: SecondsOrNone
    """From when the controller runs; sensors want to be calibrated by then."""
    cycles: Annotated[int, Meta(ge=1)]
    """Number of periods; then the command is 0."""


class YawSettings(PidSettings, frozen=True):
    """The PID of yaw."""

    reference_rad: float
    delay_s: Annotated[float, Meta(ge=0, le=10)]
    """Pure delay between command and propellers, as a network in the loop would add."""
    smith: SmithSettings | None = None
    """Left out: the PID gets yaw as it is estimated."""
    wave: WaveSettings | None = None
    """Left out: the PID commands; otherwise the loop is open, and its command goes nowhere."""


Mode: TypeAlias = Literal["platform", "free", "track"]


class CompassCheckSettings(Settings, frozen=True):
    """Contradiction of gyro and compass; then there is no yaw, and outputs go off."""

    window_s: Seconds = 2.0
    """Time constant with which turns are forgotten."""
    tolerance_rad: Positive = 0.5
    """Largest difference of their turns: the motors' iron and currents bend a compass."""
    brief_window_s: Seconds = 0.5
    """A second one, for a gyro that suddenly lies."""
    brief_tolerance_rad: Positive = 0.11
    """The most of the compass' noise (0.06), what bends it while currents change (0.03), bias."""
    share: NotNegative = 0.08
    """And so much of the turn more, for the scales of both."""


class MovementCheckSettings(Settings, frozen=True):
    """A robot that is driven and does not turn; then outputs go off for a while."""

    effort_n: NotNegative = 0.1
    """The yaw command that has to turn it; more than the bearing's friction takes."""
    still_rad_s: Positive = 0.03
    """Slower than this it stands still: noise and bias of the gyro."""
    impulse_n_s: Positive = 0.2
    """Command beyond that, times the time for which it stands still."""
    again_s: Positive = 1.0
    """After which it is driven again."""


class ControlSettings(Settings, frozen=True, kw_only=True, tag_field="mode"):
    """The controller, as far as it is the same in all modes."""

    mode: ClassVar[Mode]
    period_s: Annotated[float, Meta(ge=0.0005, le=1)]
    compass_time_constant_s: SecondsOrNone
    """Time constant of the compass' correction of the gyro's yaw; 0 leaves the compass out."""
    yaw: YawSettings
    compass_check: CompassCheckSettings = CompassCheckSettings()
    movement_check: MovementCheckSettings = MovementCheckSettings()


class PlatformSettings(ControlSettings, frozen=True, kw_only=True, tag="platform"):
    """On the rotating platform: yaw only."""

    mode: ClassVar[Mode] = "platform"


class FreeSettings(ControlSettings, frozen=True, kw_only=True, tag="free"):
    """Hovering: x, y and yaw."""

    mode: ClassVar[Mode] = "free"
    x: PositionSettings = PositionSettings()
    y: PositionSettings = PositionSettings()


class AxisSettings(PidSettings, frozen=True):
    """The PID of x or y in mode `track`, which is pushed ahead by its trajectory."""

    kp: NotNegative = 6.0
    ki: NotNegative = 0.3
    kd: NotNegative = 7.0
    anti_windup: bool = True


class TrackSettings(ControlSettings, frozen=True, kw_only=True, tag="track"):
    """Hovering along a trajectory, by an external position; what is left out is the plant's."""

    mode: ClassVar[Mode] = "track"
    x: AxisSettings = AxisSettings()
    y: AxisSettings = AxisSettings()
    mass_kg: Positive | None = None
    """Mass by the robot's model: the force that an acceleration takes."""
    yaw_inertia_kg_m2: Positive | None = None
    lever_arm_m: Positive | None = None


ControllerSettings: TypeAlias = PlatformSettings | FreeSettings | TrackSettings


class TachobotSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["tachobot"]
    imu: ImuSettings
    thrust_pairs: ThrustPairsSettings
    controller: ControllerSettings
    world: WorldSettings
    esc: EscSettings | None = None
    """Demanded in the modes that hover; on the platform nothing is coupled to it, there or not."""
    trajectory: AnyTrajectory = HoldSettings()
    """Mode `track` only, as the next."""
    position: ExternalPositionSettings = ExternalPositionSettings()

    @property
    def esc_in_use(self) -> EscSettings | None:
        """The speed controller where the robot lifts with it; None on the platform."""
        return None if self.controller.mode == "platform" else self.esc

    @property
    def mass_kg(self) -> float:
        """Return the mass by the robot's model."""
        return getattr(self.controller, "mass_kg", None) or self.world.mass_kg

    @property
    def turning_inertia(self) -> float:
        """The yaw command in N that 1 rad/s2 takes: two pairs push with it on the lever arm."""
        control, world = self.controller, self.world
        inertia = getattr(control, "yaw_inertia_kg_m2", None) or world.yaw_inertia_kg_m2
        return inertia / (2 * (getattr(control, "lever_arm_m", None) or world.lever_arm_m))

    @property
    def pair_thrust_n(self) -> float:
        """Return the full force of a pair by the thrust pairs' model, N."""
        return self.thrust_pairs.pair_thrust_n or self.world.pair_thrust_n

    @property
    def yaw_plant(self) -> SecondOrderPlant:
        """Yaw as a Smith predictor takes it to be: from a command in N to rad."""
        smith, world = self.controller.yaw.smith or SmithSettings(0.0), self.world
        inertia = smith.inertia_kg_m2 or world.yaw_inertia_kg_m2
        damping = world.yaw_damping_nms if smith.damping_nms is None else smith.damping_nms
        return SecondOrderPlant(
            gain=2.0 * world.lever_arm_m / inertia,
            damping_per_s=damping / inertia,
            lag_s=world.motor_lag_s if smith.lag_s is None else smith.lag_s,
        )
