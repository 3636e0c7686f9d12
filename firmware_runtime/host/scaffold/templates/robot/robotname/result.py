"""How a run ended: how far from the wall, and whether that is where the robot should be."""

from firmware_runtime.models.motion import Motion

NEAR_M = 0.03
SLOW_M_S = 0.05


def result(asked_m: float, motion: Motion | None) -> dict[str, object]:
    """The distance in m, None without an echo, and whether it has settled where it was asked to."""
    if motion is None:
        return {"distance_m": None, "asked_m": asked_m, "settled": False}
    error = motion.position - asked_m
    settled = abs(error) <= NEAR_M and abs(motion.rate) <= SLOW_M_S
    return {"distance_m": motion.position, "asked_m": asked_m, "settled": settled}
