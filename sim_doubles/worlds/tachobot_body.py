"""TachoBot's body in numbers: what it is (parameters) and how it moves (state)."""

from collections.abc import Iterator
from typing import Literal, NamedTuple, get_args

from msgspec import Struct

from sim_doubles.worlds.number_faults import number_faults

__all__ = ["Mounting", "Solver", "TachobotParameters", "TachobotState"]

Solver = Literal["exact", "qss2", "qss3"]
"""In closed form, or as a DEVS model of quantized integrators (`quantized`)."""

Mounting = Literal["platform", "free"]
"""On the rotating platform only yaw moves; free, hovering on its central propeller, all three."""

_POSITIVE = ("mass_kg", "lever_arm_m", "yaw_inertia_kg_m2", "pair_thrust_n")
_NOT_NEGATIVE = (
    "motor_lag_s",
    "yaw_damping_nms",
    "static_friction_nm",
    "coulomb_friction_nm",
    "gyro_noise_rad_s",
    "field_noise_t",
    "accelerometer_noise_m_s2",
)
_FINITE = ("gyro_bias_rad_s", "accelerometer_bias_m_s2")


class TachobotState(NamedTuple):
    """Position, yaw and their rates, in the axes of the room: x and y level, yaw from x to y."""

    x_m: float
    vx_m_s: float
    y_m: float
    vy_m_s: float
    yaw_rad: float
    yaw_rate_rad_s: float


class TachobotParameters(Struct, frozen=True):
    """The numbers of the plant, all SI.

    The paper gives the mass, about 3 kg; the other numbers are ours. Friction and damping default
    to zero, which is equation (1) as printed. They belong to the platform's bearing and act in no
    other mounting. Raises ValueError with every fault found.
    """

    mass_kg: float = 3.0
    lever_arm_m: float = 0.20
    """From the centre to each pair's line of thrust."""
    yaw_inertia_kg_m2: float = 0.075
    pair_thrust_n: float = 0.40
    """The most a pair can push: one motor at full duty, the other off."""
    motor_lag_s: float = 0.03
    """Time constant of duty to effective duty; 0 means at once."""
    yaw_damping_nms: float = 0.0
    """Viscous moment per rad/s, in N m s."""
    static_friction_nm: float = 0.0
    """The moment at which the standing bearing breaks away; at least Coulomb friction."""
    coulomb_friction_nm: float = 0.0
    """The constant moment against the motion of the turning bearing."""
    gyro_bias_rad_s: float = 0.01
    """What the gyro's z axis reads at rest; x and y have no bias."""
    gyro_noise_rad_s: float = 0.002
    """Standard deviation per sample of the white noise on each gyro axis."""
    field_noise_t: float = 3e-7
    """Standard deviation per measurement of the white noise on each magnetometer axis."""
    accelerometer_noise_m_s2: float = 0.0
    """Standard deviation per sample of the white noise on each accelerometer axis."""
    accelerometer_bias_m_s2: float = 0.0
    """What the accelerometer's level axes read at rest; the vertical one has no bias."""
    seed: int = 1
    """Chooses the noise."""
    mounting: Mounting = "platform"
    solver: Solver = "exact"

    def __post_init__(self) -> None:
        faults = list(self._faults())
        if faults:
            raise ValueError(f"TachoBot world: {'; '.join(faults)}")

    def _faults(self) -> Iterator[str]:
        yield from number_faults(
            self, positive=_POSITIVE, not_negative=_NOT_NEGATIVE, finite=_FINITE
        )
        if self.static_friction_nm < self.coulomb_friction_nm:
            yield (
                f"static_friction_nm is {self.static_friction_nm}, expected at least "
                f"coulomb_friction_nm, which is {self.coulomb_friction_nm}"
            )
        if self.solver not in get_args(Solver):
            yield f"solver is {self.solver!r}, expected one of {get_args(Solver)}"
        if self.mounting not in get_args(Mounting):
            yield f"mounting is {self.mounting!r}, expected one of {get_args(Mounting)}"
