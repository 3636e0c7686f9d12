"""The detective robot's rig by itself: its chips are driven by hand, and its arena is asked."""

import math

import pytest
from firmware_boards.detective.settings import DetectiveSettings
from firmware_boards.detective.wiring import DetectiveRobot

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Ending, Lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.models.state_diagram import StateDiagram
from sim_doubles.clock import ManualClock
from sim_doubles.rigs.detective import DetectiveRig

ON, OFF = bytes((0, 0x10, 0, 0)), bytes((0, 0, 0, 0x10))
STILL = 128
FOUND, GAVE_UP = Ending("the target was reached", failed=False), Ending("no echo", failed=True)


class Driven:
    """The rig on a clock that stands still, with all that its chips are told."""

    def __init__(self, *assignments: str) -> None:
        loaded = registry.load("detective", assignments)
        assert isinstance(loaded.settings, DetectiveSettings)
        self.settings = loaded.settings
        self.clock = ManualClock()
        self.rig = DetectiveRig(loaded.settings, self.clock)
        robot = loaded.build(Lines(self.rig.buses, self.rig.ports)).model
        assert isinstance(robot, DetectiveRobot)
        self.robot = robot
        self.rig.attach(robot)
        self._bus = self.rig.buses["i2c1"]
        self._bus.write(self.settings.radar_motor.address, b"\x00\x21")

    def switch_head(self, *, pwm: bool, in1: bool, in2: bool) -> None:
        table = self.settings.radar_motor
        for channel, is_on in ((table.pwm_channel, pwm), (table.in1, in1), (table.in2, in2)):
            content = bytes((6 + 4 * channel,)) + (ON if is_on else OFF)
            self._bus.write(table.address, content)

    def drive(self, left: int, right: int) -> None:
        """Give the treads their speeds, 127 at most, which silence ends after 2 s."""
        self._bus.write(self.settings.treads.address, bytes((14, 10)))
        self._bus.write(self.settings.treads.address, bytes((0, STILL + left, STILL + right)))

    def head_deg(self) -> float:
        return math.degrees(self.rig.world.head_angle_rad(self.clock()))

    def heading_deg(self) -> float:
        return math.degrees(self.rig.world.pose(self.clock()).heading_rad)


def facing(away_m: float, *assignments: str) -> Driven:
    """Return one whose front is so far from its target, straight ahead."""
    return Driven(f"world.target=[0.0, {0.25 + away_m}]", *assignments)


def test_its_head_stays_where_it_came_to_as_its_motor_is_switched_off() -> None:
    driven = Driven("world.head_start_deg=0.0")
    driven.switch_head(pwm=True, in1=False, in2=True)
    driven.clock.advance(2 * SECOND)
    driven.switch_head(pwm=False, in1=False, in2=False)
    driven.clock.advance(9 * SECOND)
    assert driven.head_deg() == pytest.approx(2 * 55.0, abs=0.1)


def test_its_treads_are_named_by_their_sides_and_turn_it_to_the_other() -> None:
    driven = Driven()
    driven.drive(left=60, right=10)
    changes_at = driven.rig.next_change_at(driven.clock())
    assert changes_at == driven.clock() + 25 * MILLISECOND
    driven.clock.advance(SECOND)
    at = driven.clock()
    levels = driven.rig.levels(at)
    assert levels["treads.left"] == pytest.approx(6 * levels["treads.right"])
    assert levels["treads.right"] > 0.0
    assert driven.heading_deg() < 90.0
    assert driven.rig.next_change_at(at) > at
    driven.clock.advance(3 * SECOND)
    assert driven.rig.next_change_at(driven.clock()) == NEVER


def test_treads_that_are_about_to_stop_are_no_outputs_that_are_on() -> None:
    driven = Driven()
    driven.drive(left=60, right=0)
    driven.clock.advance(SECOND // 2)
    assert driven.rig.outputs["treads"] == 1
    driven.drive(left=0, right=0)
    assert driven.rig.levels(driven.clock())["treads.left"] > 0.0
    assert driven.rig.outputs["treads"] == 0


@pytest.mark.parametrize(
    ("is_pushed", "said"), [(False, "it has run into something"), (True, None)]
)
def test_a_robot_may_run_into_something_only_if_it_was_pushed(
    is_pushed: bool,  # noqa: FBT001 -- a parameter of the test
    said: str | None,
) -> None:
    driven = facing(0.3)
    driven.drive(left=127, right=127)
    if is_pushed:
        driven.rig.push(0.01)
    assert driven.rig.judge() is None
    driven.clock.advance(SECOND)
    assert driven.rig.judge() == said


@pytest.mark.parametrize(
    ("away_m", "ending", "said"),
    [
        (0.3, FOUND, None),
        (0.03, FOUND, "it says that it has found its target, and stands 0.03 m away"),
        (0.6, FOUND, "it says that it has found its target, and stands 0.60 m away"),
        (0.6, GAVE_UP, None),
        (0.6, None, None),
    ],
)
def test_a_robot_that_says_it_has_found_its_target_stands_in_front_of_it(
    away_m: float, ending: Ending | None, said: str | None
) -> None:
    driven = facing(away_m)
    driven.robot.mission.ending = ending
    assert driven.rig.judge() == said


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (12, -12, None),
        (13, 0, "its treads turn at 0.10 of full speed, and 0.06 is stated"),
        (0, -13, "its treads turn at 0.10 of full speed, and 0.06 is stated"),
    ],
)
def test_treads_are_told_the_speed_that_is_stated(left: int, right: int, said: str | None) -> None:
    driven = Driven()
    driven.drive(left, right)
    driven.clock.advance(SECOND)
    assert driven.rig.missed() == said


@pytest.mark.parametrize(
    ("away_m", "says_so", "found"),
    [(0.3, True, True), (0.3, False, False), (0.03, True, False), (0.6, True, False)],
)
def test_its_mission_is_judged_by_where_it_stands_and_by_its_word(
    away_m: float,
    says_so: bool,  # noqa: FBT001 -- a parameter of the test
    found: bool,  # noqa: FBT001
) -> None:
    driven = facing(away_m, "world.start_bearing_deg=0.0")
    result = driven.rig.result(3 * SECOND, {"found": says_so})
    assert result == {
        "found": found,
        "stopped_m": pytest.approx(away_m),
        "turned_deg": 0.0,
        "time_s": 3.0,
    }


def test_how_far_it_has_turned_is_counted_from_where_it_headed_at_first() -> None:
    driven = Driven("world.start_bearing_deg=30.0")
    driven.rig.push(math.radians(-50.0))
    assert driven.rig.result(0, {})["turned_deg"] == pytest.approx(-50.0)


def test_a_robot_that_ran_into_its_target_has_not_found_it() -> None:
    driven = facing(0.1)
    driven.drive(left=127, right=127)
    driven.clock.advance(SECOND)
    driven.rig.catch_up()
    driven.rig.push(math.pi / 2)
    result = driven.rig.result(SECOND, {"found": True})
    stopped_m = result["stopped_m"]
    assert isinstance(stopped_m, float)
    assert 0.05 < stopped_m < 0.5
    assert result["found"] is False


def test_it_stands_while_it_is_held_and_drives_on_after() -> None:
    driven = facing(5.0)
    driven.drive(left=60, right=60)
    driven.rig.hold(is_held=True)
    driven.clock.advance(SECOND)
    driven.rig.hold(is_held=False)
    assert driven.rig.world.pose(driven.clock()).y_m == 0.0
    driven.clock.advance(SECOND // 2)
    assert driven.rig.world.pose(driven.clock()).y_m > 0.1


def test_the_truth_is_what_the_arena_says_of_this_instant() -> None:
    driven = facing(5.0)
    driven.drive(left=30, right=50)
    driven.clock.advance(SECOND)
    at, world = driven.clock(), driven.rig.world
    x_m, y_m, heading_rad = world.pose(at)
    assert driven.rig.truth() == {
        "detective.world.x_m": x_m,
        "detective.world.y_m": y_m,
        "detective.world.heading_rad": heading_rad,
        "detective.world.distance_m": world.distance_to_target(at),
    }


@pytest.mark.parametrize(
    ("system", "name"),
    [("MovingSystem", "movementController"), ("RadarSystem", "radarController")],
)
def test_the_states_of_its_controllers_are_in_the_log_as_they_are_entered(
    system: str, name: str
) -> None:
    driven = Driven()
    around = driven.robot.model.components[system]
    assert isinstance(around, Coupled)
    controller = around.components[name]
    assert isinstance(controller, StateDiagram)
    assert controller.watch is not None
    driven.clock.advance(SECOND)
    controller.watch("Turn")
    assert driven.rig.log.since(name, ("Turn",)) == driven.clock()


def test_a_fault_is_to_be_said_as_soon_as_what_the_treads_turned_is_read_again() -> None:
    driven = Driven()
    assert driven.rig.said_within_s == driven.settings.treads.refresh_s


def test_a_radar_that_sends_its_greatest_number_for_no_target_may_always_do_so() -> None:
    on_a_port = ("chip=maxbotix", "port=sonar", "period_s=0.2")
    serial = Driven(
        *(f"radar_sonar.{each}" for each in on_a_port),
        "ports.sonar={device='/dev/no/sonar', baud=9600}",
    )
    added = set(serial.rig.unknowable) - set(Driven().rig.unknowable)
    assert added == {"full-scale:radar_sonar"}
