"""How a run ended: how far from the wall, and whether that is where the robot should be."""

from firmware_runtime.models.motion import Motion

from robotname.settings import ControllerTable

NEAR_M = 0.03
SLOW_M_S = 0.05


def result(settings: ControllerTable, motion: Motion | None) -> dict[str, object]:
    """The distance in m, None without an echo, and whether the robot has settled there."""
    if motion is None:
        return {"distance_m": None, "settled": False}
    error = motion.position - settings.distance_m
    settled = abs(error) <= NEAR_M and abs(motion.rate) <= SLOW_M_S
    return {"distance_m": motion.position, "settled": settled}
