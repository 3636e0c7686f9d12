"""TachoBot's plant in numbers, and the tracking system in its room: what the doubles' world is."""

from typing import Annotated, Literal

from msgspec import Meta

from firmware_runtime.board.settings import Fraction, NotNegative, Positive, Settings


class PositionSensorSettings(Settings, frozen=True):
    """The room's tracking system, such as a camera; its positions come in mode `track` only."""

    rate_hz: Annotated[float, Meta(ge=0, le=200)] = 20.0
    """0: there is none."""
    delay_s: Annotated[float, Meta(ge=0, le=2)] = 0.05
    """From the instant of a position until it comes; it says so in `age_s`."""
    dropout: Fraction = 0.0
    """Share of the positions that never come."""
    noise_m: NotNegative = 0.005
    """Standard deviation of x and of y."""
    yaw: bool = False
    """True if it measures yaw too."""
    yaw_noise_rad: NotNegative = 0.01
    outages_s: tuple[tuple[float, float], ...] = ()
    """From when to when it measures nothing, such as [[20.0, 22.0]]."""
    seed: Annotated[int, Meta(ge=0)] = 1

    def faults(self) -> list[str]:
        """Return the faults between its values."""
        return [
            f"world.position.outages_s: {begin} s to {end} s, expected an end after the beginning"
            for begin, end in self.outages_s
            if not begin < end
        ]


class WorldSettings(Settings, frozen=True):
    """The plant model, all SI: what the doubles' robot is like. Not used on the robot's buses.

    The paper gives the mass, about 3 kg; the other numbers are ours. Friction and damping belong to
    the platform's bearing and act on it only; without them it is equation (1) as printed.
    """

    mass_kg: Positive = 3.0
    lever_arm_m: Positive = 0.20
    """From the centre to each pair's line of thrust."""
    yaw_inertia_kg_m2: Positive = 0.075
    pair_thrust_n: Positive = 0.40
    """The most a pair can push: one motor at full duty, the other off."""
    motor_lag_s: NotNegative = 0.03
    """Time constant of duty to effective duty; 0 means at once."""
    yaw_damping_nms: NotNegative = 0.0
    """Viscous moment per rad/s, in N m s."""
    static_friction_nm: NotNegative = 0.0
    """The moment at which the standing bearing breaks away; at least Coulomb friction."""
    coulomb_friction_nm: NotNegative = 0.0
    """The constant moment against the motion of the turning bearing."""
    gyro_bias_rad_s: float = 0.01
    """Reading of the gyro's z axis at rest; x and y have no bias."""
    gyro_noise_rad_s: NotNegative = 0.002
    """Standard deviation per sample of the white noise on each gyro axis."""
    field_noise_t: NotNegative = 3e-7
    """Standard deviation per measurement of the white noise on each magnetometer axis."""
    seed: Annotated[int, Meta(ge=0)] = 1
    """Chooses the noise."""
    solver: Literal["exact", "qss2", "qss3"] = "exact"
    """In closed form, or as a DEVS model of quantized integrators: docs/qss.md."""
    accelerometer_noise_m_s2: NotNegative = 0.03
    """Standard deviation per sample on each axis."""
    accelerometer_bias_m_s2: float = 0.0
    """Reading of its level axes at rest."""
    position: PositionSensorSettings = PositionSensorSettings()
