"""Top: the Radar System and the Movement System, wired; and their classes by name, for `.ma` files.

In1 starts; In2 and In3 are Sonar1's and Compass1's readings, In4 and In5 Compass2's and Sonar2's.
Out1 commands the radar's motor, Out2 the right tread, Out3 the left (0 stop, 1 clockwise, 2
counterclockwise). Inputs are float, whether an event file or the chips' drivers feed them.
With `avoid_obstacles` In2 is 2 for an object within reach, and Out4 is 1 at the target. With
`has_motors` two more ports take what the motors apply of their commands.
"""

from pathlib import Path
from typing import Final

from firmware_boards.detective.avoiding import (
    AvoidingMovementController,
    AvoidingMovementSystem,
    AvoidingRadarController,
    AvoidingRadarSystem,
    AvoidingSonar1,
)
from firmware_boards.detective.motor import Motor
from firmware_boards.detective.movement_system import MovementController, MovementSystem
from firmware_boards.detective.parameters import Parameters
from firmware_boards.detective.radar_system import RadarController, RadarSystem
from firmware_boards.detective.sensors import Compass1, Compass2, Sonar1, Sonar2
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.models.motion import Applied

MODEL_FILE: Final = Path(__file__).with_name("detective.ma")
"""The same model as `Detective`, in E-CD++'s format."""

ATOMIC_CLASSES: Final = {
    "Sonar1": AtomicClass(Sonar1, times={"sonarTime": "hop"}),
    "Compass1": AtomicClass(Compass1, times={"compassTime": "hop"}),
    "RadarController": AtomicClass(
        RadarController, times={"radarTime": "hop", "turnTime": "half_sweep"}
    ),
    "Motor": AtomicClass(Motor, times={"motorTime": "hop"}),
    "Compass2": AtomicClass(
        Compass2, times={"compassTime": "hop"}, numbers={"tolerance": "tolerance_deg"}
    ),
    "Sonar2": AtomicClass(Sonar2, times={"sonarTime": "hop"}),
    "MovementController": AtomicClass(MovementController, times={"movementTime": "hop"}),
    "AvoidingSonar1": AtomicClass(AvoidingSonar1, times={"sonarTime": "hop"}),
    "AvoidingRadarController": AtomicClass(
        AvoidingRadarController, times={"radarTime": "hop", "turnTime": "half_sweep"}
    ),
    "AvoidingMovementController": AtomicClass(
        AvoidingMovementController, times={"movementTime": "hop", "asideTime": "aside"}
    ),
}
"""Models that a model file may name."""


class Detective(Coupled):
    """The robot's model, nine atomic models in three coupled ones; it knows no chip."""

    def __init__(self, name: str = "top", parameters: Parameters | None = None) -> None:
        super().__init__(name)
        parameters = Parameters() if parameters is None else parameters
        self.in1 = self.in_port("In1", float)
        self.in2 = self.in_port("In2", float)
        self.in3 = self.in_port("In3", float)
        self.in4 = self.in_port("In4", float)
        self.in5 = self.in_port("In5", float)
        self.out1 = self.out_port("Out1", int)
        self.out2 = self.out_port("Out2", int)
        self.out3 = self.out_port("Out3", int)
        avoids = parameters.avoid_obstacles
        radar_system = AvoidingRadarSystem if avoids else RadarSystem
        movement_system = AvoidingMovementSystem if avoids else MovementSystem
        radar = self.add(radar_system("RadarSystem", parameters))
        movement = self.add(movement_system("MovingSystem", parameters))

        self.couple(self.in1, movement.ms_in1)
        self.couple(self.in2, radar.rs_in2)
        self.couple(self.in3, radar.rs_in3)
        self.couple(self.in4, movement.ms_in3)
        self.couple(self.in5, movement.ms_in4)
        self.couple(movement.ms_out1, radar.rs_in1)
        self.couple(radar.rs_out2, movement.ms_in2)
        self.couple(radar.rs_out1, self.out1)
        self.couple(movement.ms_out2, self.out2)
        self.couple(movement.ms_out3, self.out3)
        if parameters.has_motors:
            self.head_applied = self.in_port("head_applied", Applied)
            self.treads_applied = self.in_port("treads_applied", Applied)
            self.couple(self.head_applied, radar.head_applied)
            self.couple(self.treads_applied, movement.treads_applied)
        if isinstance(movement, AvoidingMovementSystem):
            self.couple(movement.ms_out4, self.out_port("Out4", int))
