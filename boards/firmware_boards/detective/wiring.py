"""The detective robot's schematic: the paper's model, and the hardware at its eight ports."""

from dataclasses import replace

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.compass import Compass
from firmware_drivers.radar_motor import RadarMotor, RadarMotorSettings
from firmware_drivers.sonar import Sonar
from firmware_drivers.tables.compass import CompassTable
from firmware_drivers.tables.sonar import SonarTable
from firmware_drivers.treads import Treads
from msgspec import structs

from firmware_boards.detective.detective import Detective
from firmware_boards.detective.mission import Gate, Mission
from firmware_boards.detective.parameters import Parameters
from firmware_boards.detective.second_look import SecondLook
from firmware_boards.detective.settings import (
    DetectiveSettings,
    HeadCheckTable,
    RadarMotorTable,
    TreadCheckTable,
    event_parameters,
)
from firmware_boards.detective.turning import (
    COURSE,
    HEAD,
    TREADS,
    CommandedTurn,
    HeadTurn,
    StraightCourse,
    Turn,
    VehicleTurn,
    turn_check,
)
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.cross_check import CrossCheck


class DetectiveRobot(Coupled):
    """sonars, compasses -> model (the nine atomic models of the paper) -> gates -> treads, radar.

    The model is the one that event files run on; what feeds its ports makes no difference to it.
    """

    def __init__(self, settings: DetectiveSettings, lines: Lines) -> None:
        super().__init__("detective")
        self._add_motors(settings, lines)
        self._add_sensors(settings, lines)
        self.model = self.add(Detective("model", _parameters(settings)))
        self.mission = self.add(_mission(settings, lines))
        self._wire(settings)
        self._add_second_look()
        self.commanded_turn: CommandedTurn | None = None
        self.commanded_head: CommandedTurn | None = None
        if settings.turn_check is not None:
            self.commanded_turn = self._add_turn_check(settings.turn_check)
            has_no_encoders = settings.treads.model.full_counts_s is None
            if has_no_encoders or not settings.mission.avoid_obstacles:
                self._add_course_check(settings.turn_check, from_start=has_no_encoders)
        if settings.head_check is not None:
            self.commanded_head = self._add_head_check(settings.head_check)

    @property
    def has_found(self) -> bool:
        """Return whether the mission ended in front of the target."""
        ending = self.mission.ending
        return ending is not None and not ending.failed

    def retune(self, settings: DetectiveSettings) -> None:
        """Take up how fast treads and head turn, from the next command on."""
        self.treads.settings = settings.treads.model
        self.radar_motor.settings = _radar_motor_settings(settings.radar_motor)
        if self.commanded_turn is not None and settings.turn_check is not None:
            stated_deg_s = settings.turn_check.full_turn_deg_s
            self.commanded_turn.full_deg_s = stated_deg_s * settings.treads.speed
        if self.commanded_head is not None and settings.head_check is not None:
            stated_deg_s = settings.head_check.full_turn_deg_s
            self.commanded_head.full_deg_s = stated_deg_s * settings.radar_motor.duty

    def _add_motors(self, settings: DetectiveSettings, lines: Lines) -> None:
        radar, treads = settings.radar_motor, settings.treads
        self.bridge_chip = _bridge_chip(radar, lines)
        bridge = _bridge(radar, self.bridge_chip)
        self.radar_motor = self.add(
            RadarMotor("radar_motor", bridge, _radar_motor_settings(radar), lines.interlock)
        )
        self.treads = self.add(Treads("treads", treads.chip(lines), treads.model, lines.interlock))

    def _add_sensors(self, settings: DetectiveSettings, lines: Lines) -> None:
        mission = settings.mission
        near_m = mission.near_m if mission.avoid_obstacles else 0.0
        self.radar_sonar = self.add(_sonar("radar_sonar", settings.radar_sonar, lines, near_m))
        self.body_sonar = self.add(_sonar("body_sonar", settings.body_sonar, lines))
        self.radar_compass = self.add(_compass("radar_compass", settings.radar_compass, lines))
        self.body_compass = self.add(_compass("body_compass", settings.body_compass, lines))

    def _wire(self, settings: DetectiveSettings) -> None:
        model, mission = self.model, self.mission
        self.couple(mission.in1, model.in1)
        self.couple(self.radar_sonar.detected_out, model.in2)
        self.couple(self.radar_compass.heading_out, model.in3)
        self.couple(self.body_compass.heading_out, model.in4)
        self.couple(self.body_sonar.detected_out, model.in5)
        self.radar_gate = self._add_gate("radar_gate", model.out1, self.radar_motor.turn)
        self.right_gate = self._add_gate("right_gate", model.out2, self.treads.right)
        self.left_gate = self._add_gate("left_gate", model.out3, self.treads.left)
        self.couple(self.radar_motor.applied_out, model.head_applied)
        self.couple(self.treads.applied_out, model.treads_applied)
        self.couple(model.out2, mission.right)
        self.couple(model.out3, mission.left)
        if settings.mission.avoid_obstacles:
            self.couple(model.out_ports["Out4"], mission.reached)
        sonars = (self.radar_sonar, self.body_sonar)
        compasses = (self.radar_compass, self.body_compass)
        for sonar in sonars:
            self.couple(mission.sonars, sonar.start)
        for compass in compasses:
            self.couple(mission.compasses, compass.request)
        for device in (self.radar_motor, self.treads, *sonars, *compasses):
            self.couple(device.fault_out, mission.fault)

    def _add_second_look(self) -> None:
        """What the radar finds, and neither of the next two pings -> the mission has failed."""
        look = self.add(SecondLook("second_look"))
        self.couple(self.radar_gate.passed, look.head)
        self.couple(self.radar_sonar.detected_out, look.detected)
        self.couple(self.radar_sonar.distance_out, look.distance)
        self.couple(look.fault, self.mission.contradiction)

    def _add_turn_check(self, stated: TreadCheckTable) -> CommandedTurn:
        """Commands that pass the gates, and headings -> turn_check -> the mission has failed."""
        full_deg_s = stated.full_turn_deg_s * self.treads.settings.speed
        commanded = self.add(VehicleTurn("commanded_turn", full_deg_s))
        self._add_treads_check(commanded, turn_check("turn_check", TREADS, stated))
        return commanded

    def _add_course_check(self, stated: TreadCheckTable, *, from_start: bool) -> None:
        """The same of a course that is to be straight."""
        course = self.add(StraightCourse("course", from_start=from_start))
        straight = structs.replace(stated, tolerance_deg=stated.course_deg)
        self._add_treads_check(course, turn_check("course_check", COURSE, straight))

    def _add_treads_check(self, commanded: VehicleTurn, check: CrossCheck[Turn, Turn]) -> None:
        self.couple(self.right_gate.passed, commanded.right)
        self.couple(self.left_gate.passed, commanded.left)
        self.couple(self.treads.applied_out, commanded.applied)
        self.couple(self.body_compass.heading_out, commanded.heading)
        self._add_check(commanded, check)

    def _add_head_check(self, stated: HeadCheckTable) -> CommandedTurn:
        """The same of the head and its compass, as long as the body stands."""
        full_deg_s = stated.full_turn_deg_s * self.radar_motor.settings.duty
        stop_deg, at_stop = stated.stop_deg, seconds(stated.at_stop_s)
        commanded = self.add(HeadTurn("commanded_head", full_deg_s, stop_deg, at_stop))
        self.couple(self.radar_gate.passed, commanded.motor)
        self.couple(self.radar_motor.applied_out, commanded.applied)
        self.couple(self.radar_compass.heading_out, commanded.heading)
        self.couple(self.body_compass.heading_out, commanded.body)
        self._add_check(commanded, turn_check("head_check", HEAD, stated))
        return commanded

    def _add_check(self, commanded: CommandedTurn, check: CrossCheck[Turn, Turn]) -> None:
        self.add(check)
        self.couple(commanded.turn_out, check.rate)
        self.couple(commanded.turn_out, check.value)
        self.couple(check.fault, self.mission.contradiction)

    def _add_gate(self, name: str, command: OutPort[int], motor: InPort[int]) -> Gate:
        """Command -> gate -> motor, until the mission has failed."""
        gate = self.add(Gate(name))
        self.couple(command, gate.command)
        self.couple(self.mission.failed, gate.failed)
        self.couple(gate.passed, motor)
        return gate


def _bridge_chip(table: RadarMotorTable, lines: Lines) -> Pca9685:
    """The PCA9685 of the radar's motor."""
    return Pca9685(lines.buses[table.bus], table.address, osc_hz=table.osc_hz)


def _bridge(table: RadarMotorTable, chip: Pca9685) -> HBridge:
    """The H-bridge channel on it."""
    return HBridge(chip, table.pwm_channel, table.in1, table.in2)


def _radar_motor_settings(table: RadarMotorTable) -> RadarMotorSettings:
    """Return the head's speed, and its longest time without a command."""
    return RadarMotorSettings(table.duty, table.frequency_hz, seconds(table.longest_turn_s))


def _sonar(name: str, table: SonarTable, lines: Lines, near_m: float = 0.0) -> Sonar:
    return Sonar(name, table.chip(lines), replace(table.model, near_m=near_m))


def _compass(name: str, table: CompassTable, lines: Lines) -> Compass:
    """Headings in whole degrees: the paper's model compares them with `==`."""
    return Compass(name, table.chip(lines), table.model(whole_degrees=True))


def _mission(settings: DetectiveSettings, lines: Lines) -> Mission:
    stated = settings.mission
    mission = Mission(
        "mission",
        seconds(stated.start_s),
        stated.faults,
        seconds(stated.longest_s),
        lines.interlock,
    )
    mission.counts_stops = not stated.avoid_obstacles
    return mission


def _parameters(settings: DetectiveSettings) -> Parameters:
    """The model's parameters on a robot: its head and its compasses are not the paper's."""
    mission = settings.mission
    return replace(
        event_parameters(settings),
        half_sweep=seconds(mission.half_sweep_s),
        tolerance_deg=mission.tolerance_deg,
        has_motors=True,
    )
