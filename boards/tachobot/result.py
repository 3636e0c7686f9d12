"""How a run of TachoBot ended: where it points, and whether it has come to rest there.

In mode `track`: where it is, and whether that is where its trajectory has it.
"""

import math
from typing import Final

from boards.tachobot.controller import Controller
from boards.tachobot.settings import TachobotSettings
from boards.tachobot.tracking import TrackingController
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.trajectory import PoseSetpoint
from firmware_runtime.models.trajectory_paths import Pose

SETTLED_RAD: Final = 0.02
SETTLED_RAD_S: Final = 0.05
NEVER_BEGAN: Final = "control never began"
ON_PATH_M: Final = 0.1
ON_PATH_RAD: Final = 0.1


def own_result(
    settings: TachobotSettings, controller: Controller | TrackingController
) -> dict[str, object]:
    """How it ended by what the robot itself knows."""
    if isinstance(controller, Controller):
        return yaw_result(settings, controller.attitude.motion)
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
    setpoint, state = controller.trajectory.setpoint, controller.watch.phase
    off_m = error_rad = None
    if pose is None or setpoint is None:
        reason: str | None = f"position: {state}" if state == "safe" else NEVER_BEGAN
    else:
        off_m, error_rad = _off(setpoint, pose)
        reason = _why_not_on_path(off_m, error_rad, state)
    result: dict[str, object] = {
        **(dict.fromkeys(Pose._fields) if pose is None else pose._asdict()),
        "off_m": off_m,
        "yaw_error_rad": error_rad,
        "position": state,
        "settled": reason is None,
    }
    return result if reason is None else {**result, "settled_reason": reason}


def _off(setpoint: PoseSetpoint, pose: Pose) -> tuple[float, float]:
    x, y, yaw = (goal.position - at for goal, at in zip(setpoint, pose, strict=True))
    return math.hypot(x, y), math.remainder(yaw, math.tau)


def _why_not_on_path(off_m: float, error_rad: float, state: str) -> str | None:
    if state not in {"tracking", "coasting"}:
        return f"position: {state}"
    if not off_m <= ON_PATH_M:
        return f"it is {off_m:.3f} m off its path, expected {ON_PATH_M:g} at most"
    if not abs(error_rad) <= ON_PATH_RAD:
        return f"yaw is off by {error_rad:.3f} rad, expected {ON_PATH_RAD:g} at most"
    return None


def yaw_result(
    settings: TachobotSettings, yaw: Motion | None, *, has_begun: bool = True
) -> dict[str, object]:
    """Yaw, its error (reference minus yaw), and whether both error and rate are small.

    If they are not, `settled_reason` says why. Without any yaw the numbers are None; control that
    has not begun settles nothing, wherever the robot happens to point.
    """
    if yaw is None:
        nothing = {"yaw_rad": None, "yaw_error_rad": None}
        return {**nothing, "settled": False, "settled_reason": NEVER_BEGAN}
    error = settings.controller.yaw.reference_rad - yaw.position
    reason = _why_not_settled(error, yaw.rate) if has_begun else NEVER_BEGAN
    result: dict[str, object] = {
        "yaw_rad": yaw.position,
        "yaw_error_rad": error,
        "settled": reason is None,
    }
    return result if reason is None else {**result, "settled_reason": reason}


def _why_not_settled(error: float, rate: float) -> str | None:
    if not abs(error) <= SETTLED_RAD:
        return f"yaw is off by {error:.3f} rad, expected {SETTLED_RAD:g} at most"
    if not abs(rate) <= SETTLED_RAD_S:
        return f"yaw turns at {rate:.3f} rad/s, expected {SETTLED_RAD_S:g} at most"
    return None
