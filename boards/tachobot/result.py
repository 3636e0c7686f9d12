"""How a run of TachoBot ended: where it points, and whether it has come to rest there."""

from typing import Final

from boards.tachobot.settings import TachobotSettings
from firmware_runtime.models.motion import Motion

SETTLED_RAD: Final = 0.02
SETTLED_RAD_S: Final = 0.05


def yaw_result(settings: TachobotSettings, yaw: Motion | None) -> dict[str, object]:
    """Yaw, its error (reference minus yaw), and whether both error and rate are small.

    Without any yaw, because control never began, the numbers are None.
    """
    if yaw is None:
        return {"yaw_rad": None, "yaw_error_rad": None, "settled": False}
    error = settings.controller.yaw.reference_rad - yaw.position
    settled = abs(error) <= SETTLED_RAD and abs(yaw.rate) <= SETTLED_RAD_S
    return {"yaw_rad": yaw.position, "yaw_error_rad": error, "settled": settled}
