"""The models that follow the tables of `avoidance`, and both systems with them."""

from typing import ClassVar

from firmware_boards.detective.avoidance import (
    AVOIDING_MOVEMENT,
    AVOIDING_RADAR,
    AVOIDING_SONAR1,
    aside_left,
    aside_right,
    is_ahead,
)
from firmware_boards.detective.messages import Degree
from firmware_boards.detective.movement_system import MovementController, MovementSystem
from firmware_boards.detective.parameters import ASIDE, HALF_SWEEP, HOP, Parameters
from firmware_boards.detective.radar_system import RadarController, RadarSystem
from firmware_boards.detective.sensors import Sonar1


class AvoidingSonar1(Sonar1):
    """Reports an object within reach, 2, as such."""

    def __init__(self, name: str, hop: int = HOP) -> None:
        super().__init__(name, hop)
        self.follow(AVOIDING_SONAR1, hop=hop)


class AvoidingRadarController(RadarController):
    """Hands on whether what it found is within reach: radar_out2 is 2 then, and 1 else."""

    def __init__(self, name: str, hop: int = HOP, half_sweep: int = HALF_SWEEP) -> None:
        super().__init__(name, hop, half_sweep)
        self.follow(AVOIDING_RADAR, {"degree": Degree}, hop=hop, half_sweep=half_sweep)


class AvoidingMovementController(MovementController):
    """Drives past what is low; move_in2 may be 2, and move_out6 says that the target is reached."""

    def __init__(self, name: str, hop: int = HOP, aside: int = ASIDE) -> None:
        super().__init__(name, hop)
        self.aside = aside
        self.move_out6 = self.out_port("move_out6", int)
        self.follow(
            AVOIDING_MOVEMENT,
            {
                "degree1": Degree,
                "degree2": Degree,
                "blocked": int,
                "ahead": is_ahead,
                "aside_left": aside_left,
                "aside_right": aside_right,
            },
            hop=hop,
            aside=aside,
        )


class AvoidingRadarSystem(RadarSystem):
    """The Radar System, whose RS_In2 is 2 for what is within reach."""

    sonar1: ClassVar = AvoidingSonar1
    controller: ClassVar = AvoidingRadarController


class AvoidingMovementSystem(MovementSystem):
    """The Movement System, with MS_Out4: 1 in front of the target."""

    def __init__(self, name: str, parameters: Parameters) -> None:
        super().__init__(name, parameters)
        self.ms_out4 = self.out_port("MS_Out4", int)
        controller = self.components["movementController"]
        self.couple(controller.out_ports["move_out6"], self.ms_out4)

    def controller(self, parameters: Parameters) -> AvoidingMovementController:
        """The one that drives past obstacles."""
        return AvoidingMovementController("movementController", parameters.hop, parameters.aside)
