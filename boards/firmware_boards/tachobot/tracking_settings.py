"""The tables [trajectory] and [position] of TachoBot's board.toml, for mode `track`.

Every run reads the tables; only one in mode `track` loads the models that they are for.
"""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, TypeAlias

from msgspec import Meta

from firmware_runtime.board.settings import (
    NotNegative,
    Positive,
    Seconds,
    SecondsOrNone,
    Settings,
)
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.motion import Profile

if TYPE_CHECKING:
    from firmware_runtime.models.position_estimator import EstimatorSettings
    from firmware_runtime.models.position_watch import PositionPatience
    from firmware_runtime.models.trajectory_paths import RejoinLimits

Kind: TypeAlias = Literal["hold", "line", "circle", "file"]


class ExternalPositionSettings(Settings, frozen=True, kw_only=True):
    """The external position, as `[position]` describes it, and what happens when it stops."""

    noise_m: Positive = 0.005
    """Standard deviation of a measured x or y."""
    yaw_noise_rad: Positive = 0.01
    """Noise of a measured yaw, where one comes."""
    latency_s: SecondsOrNone = 0.0
    """Age of a position beyond what its `age_s` says."""
    acceleration_noise: Positive = 0.01
    """Noise of the accelerometer, a density, m/s2 over root Hz."""
    bias_walk: NotNegative = 0.001
    """Random walk of its bias, m/s2 in a root second."""
    yaw_walk: NotNegative = 0.001
    """Random walk of the attitude's zero, rad in a root second."""
    first_velocity_m_s: Positive = 0.2
    """Greatest speed at its first position."""
    first_bias_m_s2: Positive = 0.1
    """Greatest bias of the accelerometer at first."""
    gate: Positive = 25.0
    """Greatest square of a position's error over its variance that is believed, x and y."""
    history_s: Annotated[float, Meta(gt=0, le=2)] = 0.5
    """Greatest age of a position that is still used."""
    coast_after_s: Seconds = 0.25
    """Without a position for this long it goes on by the inertial unit alone."""
    brake_after_s: Seconds = 1.0
    """For this long: it brakes and holds its yaw."""
    safe_after_s: Seconds = 3.0
    """For this long: outputs go off and the run ends as failed."""

    def faults(self) -> list[str]:
        """Return the faults between its values."""
        times = (self.coast_after_s, self.brake_after_s, self.safe_after_s)
        if times[0] < times[1] < times[2]:
            return []
        rising = "coast_after_s < brake_after_s < safe_after_s"
        return [f"position.coast_after_s: {' s, '.join(map(str, times))} s, expected {rising}"]

    def patience(self) -> "PositionPatience":
        """The times as the watch has them."""
        from firmware_runtime.models.position_watch import (  # noqa: PLC0415 -- mode track
            PositionPatience,
        )

        times = (self.coast_after_s, self.brake_after_s, self.safe_after_s)
        return PositionPatience(*map(seconds, times))

    def estimator(self, period_s: float) -> "EstimatorSettings":
        """Return the estimator's parameters, with a sample every `period_s`."""
        from firmware_runtime.models.position_estimator import (  # noqa: PLC0415 -- mode track
            EstimatorSettings,
        )
        from firmware_runtime.models.position_filter import FilterNoise  # noqa: PLC0415 -- likewise

        noise = FilterNoise(
            position_m=self.noise_m,
            yaw_rad=self.yaw_noise_rad,
            acceleration=self.acceleration_noise,
            bias_walk=self.bias_walk,
            yaw_walk=self.yaw_walk,
            first_velocity_m_s=self.first_velocity_m_s,
            first_bias_m_s2=self.first_bias_m_s2,
        )
        history = max(1, round(self.history_s / period_s))
        return EstimatorSettings(noise, self.gate, history, seconds(self.latency_s))


class TrajectorySettings(Settings, frozen=True, kw_only=True, tag_field="kind"):
    """Trajectory of the robot, with the way to its beginning or back."""

    kind: ClassVar[Kind]
    period_s: Annotated[float, Meta(ge=0.001, le=1)] = 0.02
    """From one setpoint to the next; in between the last one goes on."""
    rejoin_speed_m_s: Positive = 0.2
    rejoin_acceleration_m_s2: Positive = 0.08
    rejoin_yaw_speed_rad_s: Positive = 0.5
    rejoin_least_s: Seconds = 2.0
    """However near the path is."""
    ramp_s: Seconds = 4.0
    """From standing still to the path's own speed."""

    def rejoin(self) -> "RejoinLimits":
        """The limits as the trajectory has them."""
        from firmware_runtime.models.trajectory_paths import (  # noqa: PLC0415 -- mode track
            RejoinLimits,
        )

        return RejoinLimits(
            speed_m_s=self.rejoin_speed_m_s,
            acceleration_m_s2=self.rejoin_acceleration_m_s2,
            yaw_speed_rad_s=self.rejoin_yaw_speed_rad_s,
            least_s=self.rejoin_least_s,
            ramp_s=self.ramp_s,
        )


class HoldSettings(TrajectorySettings, frozen=True, kw_only=True, tag="hold"):
    """A place."""

    is_default_variant: ClassVar[bool] = True
    kind: ClassVar[Kind] = "hold"
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float | None = None
    """Left out, here and below: `controller.yaw.reference_rad`."""


class LineSettings(TrajectorySettings, frozen=True, kw_only=True, tag="line"):
    """From one place to another, at rest at both."""

    kind: ClassVar[Kind] = "line"
    from_x_m: float = 0.0
    from_y_m: float = 0.0
    from_yaw_rad: float | None = None
    x_m: float
    y_m: float
    yaw_rad: float | None = None
    profile: Profile = "minimum-jerk"
    speed_m_s: Positive = 0.3
    """Not exceeded."""
    acceleration_m_s2: Positive = 0.15
    """Not exceeded."""


class CircleSettings(TrajectorySettings, frozen=True, kw_only=True, tag="circle"):
    """Round and round."""

    kind: ClassVar[Kind] = "circle"
    x_m: float = 0.0
    """X of the centre."""
    y_m: float = 0.0
    radius_m: Positive = 1.0
    lap_s: Seconds = 25.0
    start_rad: float = 0.0
    """Direction from the centre in which it begins; zero is x."""
    clockwise: bool = False
    turns: bool = False
    """True if yaw turns with the path, one turn a lap."""
    yaw_rad: float | None = None


class FileSettings(TrajectorySettings, frozen=True, kw_only=True, tag="file"):
    """A file of poses."""

    kind: ClassVar[Kind] = "file"
    file: str
    """CSV with the columns t_s, x_m, y_m, yaw_rad; a spline goes through them."""


AnyTrajectory: TypeAlias = HoldSettings | LineSettings | CircleSettings | FileSettings
