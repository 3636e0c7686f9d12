"""The Movement System: drives ahead, stops on command, turns to the target and drives to it.

The table is the paper's Figure 5, as far as its text describes it: docs/robots.md compares each
state and arrow with it.
"""

from typing import Final

from firmware_boards.detective.angles import shorter_way_grows
from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.motor import Motor
from firmware_boards.detective.parameters import HOP, Parameters
from firmware_boards.detective.sensors import Compass2, Sonar2
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.motion import Applied
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State


def angles_grow(kept: Kept) -> bool:
    """Return whether the shorter way from the heading (degree2) to the target (degree1) grows."""
    return shorter_way_grows(heading=kept["degree2"].value, target=kept["degree1"].value)


def angles_fall(kept: Kept) -> bool:
    """The vehicle turns the other way."""
    return not angles_grow(kept)


MOVEMENT_CONTROLLER: Final = (
    State(
        "Stop",
        NEVER,
        Arrow("move_in1?1", "Prepare to move forward"),
    ),
    State(
        "Prepare to move forward",
        "hop",
        Arrow("move_out1!1 move_out2!1 move_out3!1", "Moving forward"),
    ),
    State(
        "Moving forward",
        NEVER,
        Arrow("move_in2?1", "Ask MC to stop"),
    ),
    State(
        "Ask MC to stop",
        "hop",
        Arrow("move_out2!0 move_out3!0", "Wait radar mess"),
    ),
    State(
        "Wait radar mess",
        NEVER,
        Arrow("move_in2?degree1", "Prepare to receive"),
    ),
    State(
        "Prepare to receive",
        "hop",
        Arrow("move_out4!1", "Wait to receive"),
    ),
    State(
        "Wait to receive",
        NEVER,
        Arrow("move_in3?degree2", "Prepare to turn"),
    ),
    State(
        "Prepare to turn",
        "hop",
        Arrow("move_out2!1 move_out3!2 move_out4!degree1", "Turn", when=angles_grow),
        Arrow("move_out2!2 move_out3!1 move_out4!degree1", "Turn", when=angles_fall),
    ),
    State(
        "Turn",
        NEVER,
        Arrow("move_in3?1", "Ask to prepare to Move forward"),
    ),
    State(
        "Ask to prepare to Move forward",
        "hop",
        Arrow("move_out3!1 move_out5!1", "Move forward", when=angles_grow),
        Arrow("move_out2!1 move_out5!1", "Move forward", when=angles_fall),
    ),
    State(
        "Move forward",
        NEVER,
        Arrow("move_in4?1", "Ask to prepare to stop"),
    ),
    State(
        "Ask to prepare to stop",
        "hop",
        Arrow("move_out2!0 move_out3!0", "Stop"),
    ),
)


class MovementController(StateDiagram):
    """Leads the vehicle: ahead, to a stop, round to the target, up to it.

    X: move_in1 start, move_in2 Radar controller (1 object detected, or the target's angle),
    move_in3 Compass2 (1 matched, or the heading's angle), move_in4 Sonar2 (1 target reached).

    Y: move_out1 start the radar; move_out2 Motor2, right tread, and move_out3 Motor3, left tread
    (0 stop, 1 clockwise, 2 counterclockwise); move_out4 Compass2 (1 catch the heading, or the angle
    to match); move_out5 Sonar2 (1 look for the target).
    """

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name)
        self.hop = hop
        self.move_in1 = self.in_port("move_in1", float)
        self.move_in2 = self.in_port("move_in2", Message)
        self.move_in3 = self.in_port("move_in3", Message)
        self.move_in4 = self.in_port("move_in4", int)
        self.applied_in = self.in_port("applied", Applied)
        self.move_out1 = self.out_port("move_out1", int)
        self.move_out2 = self.out_port("move_out2", int)
        self.move_out3 = self.out_port("move_out3", int)
        self.move_out4 = self.out_port("move_out4", Message)
        self.move_out5 = self.out_port("move_out5", int)
        self.follow(MOVEMENT_CONTROLLER, {"degree1": Degree, "degree2": Degree}, hop=hop)


class MovementSystem(Coupled):
    """Compass2, Sonar2, Movement controller, Motor2 (right tread), Motor3 (left tread).

    MS_In1 start, MS_In2 from the Radar System, MS_In3 Compass2's readings, MS_In4 Sonar2's; MS_Out1
    to the Radar System, MS_Out2 to the right tread, MS_Out3 to the left.
    """

    def __init__(self, name: str, parameters: Parameters) -> None:
        super().__init__(name)
        hop = parameters.hop
        self.ms_in1 = self.in_port("MS_In1", float)
        self.ms_in2 = self.in_port("MS_In2", Message)
        self.ms_in3 = self.in_port("MS_In3", float)
        self.ms_in4 = self.in_port("MS_In4", float)
        self.ms_out1 = self.out_port("MS_Out1", int)
        self.ms_out2 = self.out_port("MS_Out2", int)
        self.ms_out3 = self.out_port("MS_Out3", int)
        compass2 = self.add(Compass2("compass2", hop, parameters.tolerance_deg))
        sonar2 = self.add(Sonar2("sonar2", hop))
        controller = self.add(self.controller(parameters))
        motor2 = self.add(Motor("motor2", hop))
        motor3 = self.add(Motor("motor3", hop))

        self.couple(self.ms_in1, controller.move_in1)
        self.couple(self.ms_in2, controller.move_in2)
        self.couple(self.ms_in3, compass2.reading)
        self.couple(self.ms_in4, sonar2.echo)
        self.couple(compass2.answer, controller.move_in3)
        self.couple(sonar2.target, controller.move_in4)
        self.couple(controller.move_out1, self.ms_out1)
        self.couple(controller.move_out2, motor2.order)
        self.couple(controller.move_out3, motor3.order)
        self.couple(controller.move_out4, compass2.request)
        self.couple(controller.move_out5, sonar2.request)
        self.couple(motor2.spin, self.ms_out2)
        self.couple(motor3.spin, self.ms_out3)
        if parameters.has_motors:
            self.treads_applied = self.in_port("treads_applied", Applied)
            self.couple(self.treads_applied, controller.in_ports["applied"])

    def controller(self, parameters: Parameters) -> MovementController:
        """The Movement controller."""
        return MovementController("movementController", parameters.hop)
