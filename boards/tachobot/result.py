"""How a run of TachoBot ended: where it points, and whether it has come to rest there."""

from typing import Final

from boards.tachobot.settings import TachobotSettings

SETTLED_RAD: Final = 0.02
SETTLED_RAD_S: Final = 0.05


def yaw_result(settings: TachobotSettings, yaw_rad: float, rate_rad_s: float) -> dict[str, object]:
    """Yaw, its error (reference minus yaw), and whether both error and rate are small."""
    error = settings.controller.yaw.reference_rad - yaw_rad
    settled = abs(error) <= SETTLED_RAD and abs(rate_rad_s) <= SETTLED_RAD_S
    return {"yaw_rad": yaw_rad, "yaw_error_rad": error, "settled": settled}
