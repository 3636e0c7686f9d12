"""How a run ended: how far it leans, and whether it stands."""

from collections.abc import Mapping
from typing import Any

from firmware_runtime.models.motion import Motion

STANDS_RAD = 0.1
STANDS_RAD_S = 0.5


def result(motion: Motion | None, place_m: float | None) -> dict[str, object]:
    """Pitch in rad and place in m, None where unknown, and whether the robot stands."""
    if motion is None:
        return {"pitch_rad": None, "place_m": place_m, "standing": False}
    standing = abs(motion.position) <= STANDS_RAD and abs(motion.rate) <= STANDS_RAD_S
    return {"pitch_rad": motion.position, "place_m": place_m, "standing": standing}


def result_text(result: Mapping[str, Any]) -> str:
    """What the robot did, in a sentence."""
    pitch_rad, place_m = result["pitch_rad"], result["place_m"]
    if pitch_rad is None:
        return "the robot never knew how far it leans"
    place = "" if place_m is None else f" at {place_m:.2f} m"
    if result["standing"]:
        return f"the robot stands{place}, leaning by {pitch_rad:.2f} rad"
    return f"the robot does not stand{place}: it leans by {pitch_rad:.2f} rad"
