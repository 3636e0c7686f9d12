"""Obstacles in the way: what both controllers and Sonar1 do beside the paper's tables.

The paper has Sonar2 help to avoid obstacles and gives no states for it; these are ours. They begin
with its tables: states and arrows are added, and three arrows lead elsewhere. Sonar2 looks ahead
whenever the vehicle drives. Where it finds something the vehicle stops, and the radar, which looks
over what is low, looks for the target again:

- a detection far away (In2 is 1): something low stands before the target. The vehicle turns aside,
  drives past for a while, and the radar looks again, which leads to the paper's turn and drive.
- a detection within reach (In2 is 2), and ahead: it is the target. `move_out6` says so.
- within reach, but not ahead: the vehicle turns to it, as to any target.

Aside is to the left of the target; once something stood in the way there too, to the right.
"""

from collections.abc import Mapping, Sequence
from typing import Final

from firmware_boards.detective.angles import are_close
from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.movement_system import MOVEMENT_CONTROLLER
from firmware_boards.detective.radar_system import RADAR_CONTROLLER
from firmware_boards.detective.sensors import SONAR1
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.state_table import Arrow, Kept, State

ASIDE_DEG: Final = 120.0
"""From the target to where the vehicle drives past: also away from a wall that is not square."""
AHEAD_DEG: Final = 45.0
"""A near target is ahead if it is no further than this from where the vehicle heads."""


def left_is_free(kept: Kept) -> bool:
    """Nothing has stood in the way to the left yet."""
    return "blocked" not in kept


def left_is_blocked(kept: Kept) -> bool:
    """Something has, in this mission."""
    return not left_is_free(kept)


def is_ahead(value: Message, kept: Kept) -> bool:
    """Return whether an angle is where the vehicle heads: it faced the last target."""
    heading: Degree = kept["degree1"]
    return isinstance(value, Degree) and are_close(value.value, heading.value, AHEAD_DEG)


def aside_left(kept: Kept) -> Degree:
    """Well away from the target, angles growing."""
    target: Degree = kept["degree1"]
    return Degree((target.value + ASIDE_DEG) % 360)


def aside_right(kept: Kept) -> Degree:
    """Well away from the target, angles falling."""
    target: Degree = kept["degree1"]
    return Degree((target.value - ASIDE_DEG) % 360)


def extended(
    states: Sequence[State],
    arrows: Mapping[str, Sequence[Arrow]],
    instead: Mapping[str, Sequence[Arrow]],
    *added: State,
) -> tuple[State, ...]:
    """A table with arrows behind those of some states, others in place of some, more states."""
    kept = (
        State(
            state.name,
            state.duration,
            *instead.get(state.name, state.arrows),
            *arrows.get(state.name, ()),
            moving=state.moving,
        )
        for state in states
    )
    return (*kept, *added)


AVOIDING_SONAR1: Final = extended(
    SONAR1,
    {"Listen": [Arrow("echo?2", "Report near object")]},
    {},
    State("Report near object", "hop", Arrow("object!2", "Listen")),
)

_NEAR: Final = [Arrow("radar_in2?2", "Ask motor1 and MC to stop, near")]
AVOIDING_RADAR: Final = extended(
    RADAR_CONTROLLER,
    {"Ask motor1 to turn right": _NEAR, "Ask motor1 to turn left": _NEAR},
    {},
    State(
        "Ask motor1 and MC to stop, near",
        "hop",
        Arrow("radar_out1!0 radar_out2!2 radar_out3!1", "Wait compass1 degree"),
    ),
)

AVOIDING_MOVEMENT: Final = extended(
    MOVEMENT_CONTROLLER,
    {
        "Moving forward": [
            Arrow("move_in2?2", "Ask MC to stop"),
            Arrow("move_in4?1", "Ask to stop before obstacle"),
        ],
    },
    {
        "Prepare to move forward": [
            Arrow("move_out1!1 move_out2!1 move_out3!1 move_out5!1", "Moving forward")
        ],
        "Ask to prepare to stop": [
            Arrow("move_out1!1 move_out2!0 move_out3!0", "Look at obstacle")
        ],
    },
    # Found while the radar looks for the first time: it goes on, the vehicle stands.
    State(
        "Ask to stop before obstacle",
        "hop",
        Arrow("move_out2!0 move_out3!0", "Look for target"),
        Arrow("move_in2?1", "Ask MC to stop"),
        Arrow("move_in2?2", "Ask MC to stop"),
    ),
    State(
        "Look for target",
        NEVER,
        Arrow("move_in2?1", "Wait radar mess"),
        Arrow("move_in2?2", "Wait radar mess"),
    ),
    # Found on the way to the target: is it the target?
    State(
        "Look at obstacle",
        NEVER,
        Arrow("move_in2?1", "Wait degree past obstacle"),
        Arrow("move_in2?2", "Wait near degree"),
    ),
    State(
        "Wait near degree",
        NEVER,
        Arrow("move_in2?ahead", "Report target reached"),
        Arrow("move_in2?degree1", "Prepare to receive"),
    ),
    State("Report target reached", "hop", Arrow("move_out6!1", "Stop")),
    # It is not: past it.
    State(
        "Wait degree past obstacle",
        NEVER,
        Arrow("move_in2?degree1", "Prepare to turn aside"),
    ),
    State(
        "Prepare to turn aside",
        "hop",
        Arrow("move_out2!1 move_out3!2 move_out4!aside_left", "Turn left", when=left_is_free),
        Arrow("move_out2!2 move_out3!1 move_out4!aside_right", "Turn right", when=left_is_blocked),
    ),
    State("Turn left", NEVER, Arrow("move_in3?1", "Prepare to drive aside, left")),
    State("Turn right", NEVER, Arrow("move_in3?1", "Prepare to drive aside, right")),
    State("Prepare to drive aside, left", "hop", Arrow("move_out3!1 move_out5!1", "Drive aside")),
    State("Prepare to drive aside, right", "hop", Arrow("move_out2!1 move_out5!1", "Drive aside")),
    State(
        "Drive aside",
        "aside",
        Arrow("move_out1!1 move_out2!0 move_out3!0", "Look for target"),
        Arrow("move_in4?blocked", "Ask to stop aside"),
        moving=True,
    ),
    State(
        "Ask to stop aside",
        "hop",
        Arrow("move_out1!1 move_out2!0 move_out3!0", "Look for target"),
    ),
)
