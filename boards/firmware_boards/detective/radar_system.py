"""The Radar System: turns the radar to and fro until its sonar detects, then sends the direction.

The table is the paper's Figure 4, as far as its text describes it: docs/robots.md compares each
state and arrow with it.
"""

from typing import ClassVar, Final

from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.motor import Motor
from firmware_boards.detective.parameters import HALF_SWEEP, HOP, Parameters
from firmware_boards.detective.sensors import Compass1, Sonar1
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.motion import Applied
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State

RADAR_CONTROLLER: Final = (
    State(
        "Idle",
        NEVER,
        Arrow("radar_in1?1", "Prepare for Working"),
    ),
    State(
        "Prepare for Working",
        "hop",
        Arrow("radar_out1!1", "Ask motor1 to turn right"),
    ),
    State(
        "Ask motor1 to turn right",
        "half_sweep",
        Arrow("radar_out1!2", "Ask motor1 to turn left"),
        Arrow("radar_in2?1", "Ask motor1 and MC to stop"),
        moving=True,
    ),
    State(
        "Ask motor1 to turn left",
        "half_sweep",
        Arrow("radar_out1!1", "Ask motor1 to turn right"),
        Arrow("radar_in2?1", "Ask motor1 and MC to stop"),
        moving=True,
    ),
    State(
        "Ask motor1 and MC to stop",
        "hop",
        Arrow("radar_out1!0 radar_out2!1 radar_out3!1", "Wait compass1 degree"),
    ),
    State(
        "Wait compass1 degree",
        NEVER,
        Arrow("radar_in3?degree", "Send mess. degree to MC"),
    ),
    State(
        "Send mess. degree to MC",
        "hop",
        Arrow("radar_out2!degree", "Idle"),
    ),
)


class RadarController(StateDiagram):
    """Leads the radar: to and fro, to a stop, to the angle of what it found.

    X: radar_in1 start, radar_in2 object detected, radar_in3 angle of the object.

    Y: radar_out1 Motor1 (0 stop, 1 clockwise, 2 counterclockwise), radar_out2 Movement System
    (1 stop, or the target's angle), radar_out3 Compass1 (1 detect the angle).

    Half a sweep is one of the head: its time stands still while the motor applies nothing.
    """

    def __init__(self, name: str, hop: int = HOP, half_sweep: int = HALF_SWEEP) -> None:
        super().__init__(name)
        self.hop = hop
        self.half_sweep = half_sweep
        self.radar_in1 = self.in_port("radar_in1", int)
        self.radar_in2 = self.in_port("radar_in2", int)
        self.radar_in3 = self.in_port("radar_in3", Degree)
        self.applied_in = self.in_port("applied", Applied)
        self.radar_out1 = self.out_port("radar_out1", int)
        self.radar_out2 = self.out_port("radar_out2", Message)
        self.radar_out3 = self.out_port("radar_out3", int)
        self.follow(RADAR_CONTROLLER, {"degree": Degree}, hop=hop, half_sweep=half_sweep)


class RadarSystem(Coupled):
    """Sonar1, Compass1, Radar controller, Motor1.

    RS_In1 start, RS_In2 Sonar1's readings, RS_In3 Compass1's; RS_Out1 to the radar's motor, RS_Out2
    to the Movement System.
    """

    sonar1: ClassVar[type[Sonar1]] = Sonar1
    controller: ClassVar[type[RadarController]] = RadarController

    def __init__(self, name: str, parameters: Parameters) -> None:
        super().__init__(name)
        hop = parameters.hop
        self.rs_in1 = self.in_port("RS_In1", int)
        self.rs_in2 = self.in_port("RS_In2", float)
        self.rs_in3 = self.in_port("RS_In3", float)
        self.rs_out1 = self.out_port("RS_Out1", int)
        self.rs_out2 = self.out_port("RS_Out2", Message)
        sonar1 = self.add(self.sonar1("sonar1", hop))
        compass1 = self.add(Compass1("compass1", hop))
        controller = self.add(self.controller("radarController", hop, parameters.half_sweep))
        motor1 = self.add(Motor("motor1", hop))

        self.couple(self.rs_in1, controller.radar_in1)
        self.couple(self.rs_in2, sonar1.echo)
        self.couple(self.rs_in3, compass1.reading)
        self.couple(sonar1.object, controller.radar_in2)
        self.couple(compass1.degree, controller.radar_in3)
        self.couple(controller.radar_out1, motor1.order)
        self.couple(controller.radar_out2, self.rs_out2)
        self.couple(controller.radar_out3, compass1.request)
        self.couple(motor1.spin, self.rs_out1)
        if parameters.has_motors:
            self.head_applied = self.in_port("head_applied", Applied)
            self.couple(self.head_applied, controller.in_ports["applied"])
