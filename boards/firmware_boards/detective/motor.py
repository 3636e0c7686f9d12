"""Motor1, Motor2 and Motor3: the radar's motor and those of the right and the left tread."""

from typing import Final

from firmware_boards.detective.parameters import HOP
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State

MOTOR: Final = (
    State(
        "Stopped",
        NEVER,
        Arrow("order?1", "Prepare to spin clockwise"),
        Arrow("order?2", "Prepare to spin counterclockwise"),
    ),
    State(
        "Prepare to spin clockwise",
        "hop",
        Arrow("spin!1", "Spinning clockwise"),
        Arrow("order?0", "Prepare to stop"),
        Arrow("order?2", "Prepare to spin counterclockwise"),
    ),
    State(
        "Spinning clockwise",
        NEVER,
        Arrow("order?0", "Prepare to stop"),
        Arrow("order?2", "Prepare to spin counterclockwise"),
    ),
    State(
        "Prepare to spin counterclockwise",
        "hop",
        Arrow("spin!2", "Spinning counterclockwise"),
        Arrow("order?0", "Prepare to stop"),
        Arrow("order?1", "Prepare to spin clockwise"),
    ),
    State(
        "Spinning counterclockwise",
        NEVER,
        Arrow("order?0", "Prepare to stop"),
        Arrow("order?1", "Prepare to spin clockwise"),
    ),
    State(
        "Prepare to stop",
        "hop",
        Arrow("spin!0", "Stopped"),
        Arrow("order?1", "Prepare to spin clockwise"),
        Arrow("order?2", "Prepare to spin counterclockwise"),
    ),
)


class Motor(StateDiagram):
    """Takes commands and passes them to its motor; 0: stop, 1: clockwise, 2: counterclockwise.

    A command for what it already does has no arrow and puts nothing out. While it prepares, the
    newest command counts.
    """

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name)
        self.order = self.in_port("order", int)
        self.spin = self.out_port("spin", int)
        self.hop = hop
        self.follow(MOTOR, hop=hop)
