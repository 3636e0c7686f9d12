"""Numbers that the paper leaves open, with defaults."""

from dataclasses import dataclass
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND

HOP: Final = 10 * MILLISECOND
HALF_SWEEP: Final = 3 * SECOND
TOLERANCE_DEG: Final = 0.0
ASIDE: Final = 8 * SECOND


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of the whole robot; `detective.ma` sets them one model at a time."""

    hop: int = HOP
    """Ns that every model holds a message before it passes it on."""
    half_sweep: int = HALF_SWEEP
    """Ns from one turn order of the radar to the opposite one."""
    tolerance_deg: float = TOLERANCE_DEG
    """The heading matches the target when it is no further away than this."""
    avoid_obstacles: bool = False
    """True if Sonar2 looks ahead on every drive: see avoidance.py. Not in the paper's tables."""
    aside: int = ASIDE
    """Ns that the vehicle drives past an obstacle before the radar looks for the target again."""
    has_motors: bool = False
    """True if there are ports for what the motors apply; event files have no motors."""
