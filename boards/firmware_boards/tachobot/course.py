"""The path that TachoBot's settings describe, and whether its propellers can follow it."""

from pathlib import Path as FilePath

from firmware_boards.tachobot.settings import TachobotSettings
from firmware_boards.tachobot.tracking_settings import CircleSettings, HoldSettings, LineSettings
from firmware_runtime.models.motion import Path
from firmware_runtime.models.trajectory_file import path_of_file
from firmware_runtime.models.trajectory_paths import Circle, Hold, Line, Pose
from firmware_runtime.system.elementary import hypot

LOOKED_AT = 2000
"""Instants of a path at which it is held against what the propellers can do."""


def path_of(settings: TachobotSettings) -> Path:
    """The path. Raises ValueError for what is none, such as a file with faults."""
    trajectory, yaw_rad = settings.trajectory, settings.controller.yaw.reference_rad
    if isinstance(trajectory, HoldSettings):
        return Hold(_pose(trajectory.x_m, trajectory.y_m, trajectory.yaw_rad, yaw_rad))
    if isinstance(trajectory, LineSettings):
        begin = _pose(trajectory.from_x_m, trajectory.from_y_m, trajectory.from_yaw_rad, yaw_rad)
        end = _pose(trajectory.x_m, trajectory.y_m, trajectory.yaw_rad, yaw_rad)
        limits = trajectory.speed_m_s, trajectory.acceleration_m_s2
        return Line(begin, end, *limits, trajectory.profile)
    if isinstance(trajectory, CircleSettings):
        return Circle(
            centre=_pose(trajectory.x_m, trajectory.y_m, trajectory.yaw_rad, yaw_rad),
            radius_m=trajectory.radius_m,
            lap_s=trajectory.lap_s,
            start_rad=trajectory.start_rad,
            clockwise=trajectory.clockwise,
            turns=trajectory.turns,
        )
    return path_of_file(FilePath(trajectory.file))


def course_faults(settings: TachobotSettings) -> list[str]:
    """Return the faults of a path that cannot be followed, each with its key."""
    kind = settings.trajectory.kind
    try:
        path = path_of(settings)
    except ValueError as error:
        return [f"trajectory.{'file' if kind == 'file' else 'kind'}: {error}"]
    most = 2 * settings.pair_thrust_n / settings.mass_kg
    if kind == "circle":
        spans_s = [0.0]
    else:
        spans_s = [n * path.duration_s / LOOKED_AT for n in range(LOOKED_AT)]
    at_s = max(spans_s, key=lambda t_s: _acceleration(path, t_s))
    if (needed := _acceleration(path, at_s)) <= most:
        return []
    found = f"the path takes {needed:.3g} m/s2 at {at_s:.3g} s"
    return [f"trajectory.kind: {found}, expected at most {most:.3g} m/s2, all that two pairs give"]


def _acceleration(path: Path, t_s: float) -> float:
    x, y, _ = path.at(t_s)
    return hypot(x.acceleration, y.acceleration)


def _pose(x_m: float, y_m: float, yaw_rad: float | None, otherwise_rad: float) -> Pose:
    return Pose(x_m, y_m, otherwise_rad if yaw_rad is None else yaw_rad)
