"""End of a run of TachoBot: where it points, and whether it has come to rest there.

Mode `track` has a result of its own (`track_result`).
"""

from typing import Final

from firmware_runtime.models.motion import Motion

SETTLED_RAD: Final = 0.02
SETTLED_RAD_S: Final = 0.05
NEVER_BEGAN: Final = "control never began"


def yaw_result(
    reference_rad: float, yaw: Motion | None, *, has_begun: bool = True
) -> dict[str, object]:
    """Yaw, its error (reference minus yaw), and whether both error and rate are small.

    The reference is the one in force at the end, and stated. If error or rate are not small,
    `settled_reason` says why. Without any yaw the numbers are None; control that has not begun
    settles nothing, wherever the robot happens to point.
    """
    reference = {"yaw_reference_rad": reference_rad}
    if yaw is None:
        nothing = {"yaw_rad": None, **reference, "yaw_error_rad": None}
        return {**nothing, "settled": False, "settled_reason": NEVER_BEGAN}
    error = reference_rad - yaw.position
    reason = _why_not_settled(error, yaw.rate) if has_begun else NEVER_BEGAN
    result: dict[str, object] = {
        "yaw_rad": yaw.position,
        **reference,
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
