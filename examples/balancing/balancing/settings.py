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


class ImuTable(Settings, frozen=True):
    """The MPU-9250 on the axle."""

    bus: str
    address: Address
    mounting: str
    """Which chip axis points along body x (forward), y (left) and z (up)."""
    sample_hz: int
    """A divisor of 1000; more than the control rate."""
    bandwidth_hz: int
    calibration_s: Seconds
    """How long the robot is held still while the gyro's bias is measured."""


class BridgeTable(Settings, frozen=True):
    """Three outputs of the PCA9685 that an H-bridge channel hangs on."""

    pwm_channel: Channel
    in1: Channel
    in2: Channel
    is_reversed: bool = False
    """Whether this motor is mounted the other way round."""


class WheelsTable(Settings, frozen=True):
    """The two motors, each on an H-bridge channel behind one PCA9685."""

    bus: str
    address: Address
    osc_hz: Positive
    """Measured frequency of this chip's oscillator, nominally 25 MHz."""
    frequency_hz: Positive
    timeout_s: Seconds
    left: BridgeTable
    right: BridgeTable


class RollingCheckTable(Settings, frozen=True):
    """Contradiction of IMU and motors about how the robot rolls; then it lets go of its motors."""

    window_s: Seconds = 0.5
    """Time constant with which changes of speed are forgotten."""
    tolerance_m_s: Positive = 0.3
    """Largest difference: a push of 2 rad/s gives 0.13."""
    share: NotNegative = 0.3
    """And so much of the change more: motors that pull are slower than their voltage says."""
    smoothing_s: Seconds = 0.1
    """Over which both are averaged: a push is felt at once, and the motors follow."""
    settling_s: Seconds = 0.1
    """How long nothing is compared once it balances: a hand may still hold it."""


class ControllerTable(Settings, frozen=True):
    """The controller; gains in share of full voltage per rad, rad s and rad/s."""

    period_s: Annotated[float, Meta(ge=0.002, le=0.05)]
    tilt_time_constant_s: Positive
    """How slowly the accelerometer corrects the gyro's pitch."""
    upright_rad: Annotated[float, Meta(gt=0, le=1)]
    """Pitch, either way, within which it can balance."""
    steady_s: Seconds
    """How long it has to be upright before the motors are driven."""
    kp: NotNegative
    ki: NotNegative
    kd: NotNegative
    max_drive: Annotated[float, Meta(gt=0, le=1)]
    lean_per_speed_rad: Annotated[
        NotNegative,
        Meta(description="How far it leans back for full speed, so that it comes to a stop."),
    ]
    lean_per_place_rad_s: Annotated[
        NotNegative,
        Meta(
            description="How far it leans back for each second of full speed away from where it is "
            "to stand."
        ),
    ]
    full_speed_m_s: Positive
    """What full voltage comes to on level ground."""
    rolling_check: RollingCheckTable = RollingCheckTable()


class WorldTable(Settings, frozen=True):
    """The plant model. Not used on the real robot's bus."""

    body_mass_kg: Positive
    centre_height_m: Positive
    body_inertia_kg_m2: Positive
    """About the centre of mass."""
    wheel_mass_kg: Positive
    """Of both, with what their inertia and the motors' adds."""
    wheel_radius_m: Positive
    stall_torque_nm: Positive
    """Of one motor at full voltage."""
    no_load_rad_s: Positive
    start_pitch_rad: Annotated[float, Meta(ge=-1.2, le=1.2)]
    held_s: SecondsOrNone
    """How long a hand holds it in place at the start, at least: it waits for the motors to push."""


class BalancingSettings(BoardSettings, frozen=True, kw_only=True):
    """The whole file."""

    board: Literal["balancing"]
    imu: ImuTable
    wheels: WheelsTable
    controller: ControllerTable
    world: WorldTable
