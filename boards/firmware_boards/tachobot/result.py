"""End of a run of TachoBot: where it points, and whether it has come to rest there.

Mode `track` has a result of its own (`track_result`).
"""

import math
from collections.abc import Mapping
from typing import Any, Final

from firmware_runtime.models.motion import Motion

SETTLED_RAD: Final = 0.02
SETTLED_RAD_S: Final = 0.05
NEVER_BEGAN: Final = "control never began"


def yaw_result(
    reference_rad: float, yaw: Motion | None, *, has_begun: bool = True
) -> dict[str, object]:
    """Yaw, its error (reference minus yaw), and whether both error and rate are small.

    Whole turns are no error: those of a time without samples nobody knows. The reference is the one
    in force at the end, and stated. If error or rate are not small, `settled_reason` says why.
    Without any yaw the numbers are None; control that has not begun settles nothing, wherever the
    robot happens to point.
    """
    reference = {"yaw_reference_rad": reference_rad}
    if yaw is None:
        nothing = {"yaw_rad": None, **reference, "yaw_error_rad": None}
        return {**nothing, "settled": False, "settled_reason": NEVER_BEGAN}
    error = math.remainder(reference_rad - yaw.position, math.tau)
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


def result_text(result: Mapping[str, Any]) -> str:
    """Say in a sentence where it turned to, or how well it kept to its path in mode `track`."""
    if result.get("off_m") is not None:
        return _track_text(result)
    reason, yaw_rad = result.get("settled_reason"), result.get("yaw_rad")
    if yaw_rad is None or reason == NEVER_BEGAN:
        return f"TachoBot did not turn: {reason}"
    turned = f"TachoBot turned to {yaw_rad:.2f} rad"
    if not result["settled"]:
        return f"{turned} and has not settled: {reason}"
    after_s = result.get("settled_after_s")
    after = "" if after_s is None else f" after {after_s:.1f} s"
    return f"{turned} and settled{after}"


def _track_text(result: Mapping[str, Any]) -> str:
    if result["settled"]:
        return f"TachoBot followed its path; at the end it was {result['off_m']:.2f} m off"
    return f"TachoBot did not keep to its path: {result['settled_reason']}"
