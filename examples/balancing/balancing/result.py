"""How a run ended: how far it leans, and whether it stands."""

from firmware_runtime.models.motion import Motion

STANDS_RAD = 0.1
STANDS_RAD_S = 0.5


def result(motion: Motion | None, place_m: float | None) -> dict[str, object]:
    """Pitch in rad and place in m, None where unknown, and whether the robot stands."""
    if motion is None:
        return {"pitch_rad": None, "place_m": place_m, "standing": False}
    standing = abs(motion.position) <= STANDS_RAD and abs(motion.rate) <= STANDS_RAD_S
    return {"pitch_rad": motion.position, "place_m": place_m, "standing": standing}
