"""End of a run in mode `track`: its position, and whether that is where its trajectory has it."""

import math
from typing import Final

from firmware_boards.tachobot.result import NEVER_BEGAN
from firmware_boards.tachobot.tracking import TrackingController
from firmware_runtime.models.motion import PoseSetpoint
from firmware_runtime.models.trajectory_paths import Pose

ON_PATH_M: Final = 0.1
ON_PATH_RAD: Final = 0.1


def own_track_result(controller: TrackingController) -> dict[str, object]:
    """The same by what the robot itself knows."""
    state, motion = controller.estimator.history.state, controller.attitude.motion
    if state is None or motion is None:
        return track_result(controller, None)
    place = state.planar.position
    pose = Pose(place.real, place.imag, motion.position + state.offset_rad)
    return track_result(controller, pose)


def track_result(controller: TrackingController, pose: Pose | None) -> dict[str, object]:
    """Pose, how far it is from the trajectory, how good the position is; `settled` if it is near.

    If it is not, `settled_reason` says why.
    """
    trajectory, state = controller.trajectory, controller.watch.phase
    off_m = error_rad = None
    if pose is None or trajectory.setpoint is None or trajectory.goal is None:
        reason: str | None = _without(controller) if state == "safe" else NEVER_BEGAN
    else:
        off_m, error_rad = _off(trajectory.goal, pose)
        reason = _why_not_on_path(controller, off_m, error_rad)
    result: dict[str, object] = {
        **(dict.fromkeys(Pose._fields) if pose is None else pose._asdict()),
        "off_m": off_m,
        "yaw_error_rad": error_rad,
        "position": state,
        "settled": reason is None,
    }
    return result if reason is None else {**result, "settled_reason": reason}


def _off(goal: PoseSetpoint, pose: Pose) -> tuple[float, float]:
    x, y, yaw = (setpoint.position - at for setpoint, at in zip(goal, pose, strict=True))
    return math.hypot(x, y), math.remainder(yaw, math.tau)


def _why_not_on_path(controller: TrackingController, off_m: float, error_rad: float) -> str | None:
    if controller.watch.phase not in {"tracking", "coasting"}:
        return _without(controller)
    if not off_m <= ON_PATH_M:
        return f"it is {off_m:.3f} m off its path, expected {ON_PATH_M:g} at most"
    if not abs(error_rad) <= ON_PATH_RAD:
        return f"yaw is off by {error_rad:.3f} rad, expected {ON_PATH_RAD:g} at most"
    return None


def _without(controller: TrackingController) -> str:
    """That there is no position to go by, and how many of those that came were not believed."""
    state, estimator = controller.watch.phase, controller.estimator
    if not estimator.unexpected:
        return f"position: {state}"
    came = estimator.taken + estimator.refused
    far = f"{estimator.unexpected} of {came} were too far from where they were expected"
    return f"position: {state}; {far} (position.noise_m, position.gate)"
