"""Roles of a board's components, the two ends they make, and what is wrong with such tables."""

from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.ends import (
    check_ends,
    end_of,
    ends_of,
    gains_elsewhere,
    other_end,
    robot_of,
    role_without_hardware,
)
from firmware_runtime.board.registry import Board, load
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.roles import components_of
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.errors import ConfigError, SettingError
from firmware_runtime.lab.experiments.loop_model import loop_board, loop_end
from firmware_runtime.runs.tuning import tuning_of


def left_end(board: Board) -> object:
    return end_of(board, "left")


def model_of(board: Board) -> Coupled:
    return board.unconnected().model


def part_of_role(board: Board, role: str) -> Part:
    model = model_of(board)
    return part_of(model, components_of(board.settings.roles, model, role))


def test_the_robot_end_of_tachobot_holds_its_chips() -> None:
    board = load("tachobot")
    part = part_of_role(board, "robot")
    assert list(part.model.components) == ["thrust_pairs", "imu"]
    assert list(part.entering) == ["controller.forces"]
    assert list(part.leaving) == ["imu.sample", "thrust_pairs.applied"]


def test_the_controller_is_what_no_role_names() -> None:
    board = load("detective")
    part = part_of_role(board, "controller")
    assert list(part.model.components) == ["model"]
    assert list(part.leaving) == ["model.Out1", "model.Out2", "model.Out3"]
    assert list(part.entering) == [
        "mission.in1",
        "radar_sonar.detected",
        "radar_compass.heading_deg",
        "body_compass.heading_deg",
        "body_sonar.detected",
        "radar_motor.applied",
        "treads.applied",
    ]


@pytest.mark.parametrize(
    ("roles", "role", "words"),
    [
        ({}, "pilot", "pilot: this board has no such role"),
        ({"robot": ("imu",)}, "pilot", "pilot: this board has no such role"),
        ({"robot": ("wheels",)}, "robot", "robot: no component is left"),
    ],
)
def test_a_role_that_the_board_has_not_or_that_is_empty_is_refused(
    roles: dict[str, tuple[str, ...]], role: str, words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        components_of(roles, model_of(load("tachobot")), role)


def faults_of(*assignments: str) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as refused:
        load("tachobot", assignments)
    return refused.value.faults


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ('roles.robot=["imu", "wings"]', "roles.robot: 'wings'"),
        ('roles.left=["imu"]', "roles.left: 'imu' is in roles.robot already"),
        ('roles.robot=["imu", "imu"]', "'imu' is named twice"),
        ("roles.left=[]", "roles.left: names no component"),
        ('roles."Left one"=["controller"]', "roles"),
        ('link.retain=["imu.fault"]', "link.retain: 'imu.fault' crosses no cut"),
        ('link.limits={"imu.fault"=[0.0, 1.0]}', "link.limits: 'imu.fault' crosses no cut"),
        ('link.limits={"controller.forces"=[1.0, -1.0]}', "link.limits.controller.forces"),
        ('link.limits={"controller.forces"=[-inf, 1.0]}', "link.limits"),
        ("link.timeout_s=0.0", "link.timeout_s"),
        ("link.keep=0", "link.keep"),
    ],
)
def test_it_is_named(assignment: str, words: str) -> None:
    assert any(words in fault for fault in faults_of(assignment))


def test_boards_are_sound_and_all_faults_are_named_at_once() -> None:
    assert load("tachobot").settings.link.retain == ("esc.armed",)
    assert load("tachobot", ["controller.mode='free'"]).settings.roles
    assert load("detective").settings.roles
    limits = 'link.limits={"controller.forces"=[1.0, -1.0]}'
    assert len(faults_of('roles.robot=["wings"]', "roles.left=[]", limits)) == 3
    everything = ["imu", "thrust_pairs", "esc", "lift", "position_input", "controller"]
    (fault,) = faults_of(f"roles.robot={everything}", "link.retain=[]")
    assert fault.endswith("crosses no cut between roles; expected none, as nothing does")


def test_a_port_is_no_component_and_optional_components_are_names() -> None:
    with pytest.raises(ConfigError) as refused:
        load("detective", ['roles.robot=["treads", "model.Out4"]'])
    (fault,) = refused.value.faults
    assert fault.startswith("roles.robot: 'model.Out4': expected some of ")
    assert fault.count("model.Out4") == 1

    def build(_settings: object, _lines: object) -> Robot:
        return Robot(Coupled("none"), (), ())

    with pytest.raises(SettingError, match="optional_components"):
        BoardDefinition(settings=BoardSettings, build=build, optional_components="esc")


@pytest.mark.parametrize(
    ("assignment", "role"),
    [
        ([], "controller"),
        (['roles.mind=["controller"]'], "mind"),
        (['roles={mind=["controller"]}'], "mind"),
    ],
)
def test_the_role_without_hardware_goes_by_any_name(assignment: list[str], role: str) -> None:
    assert role_without_hardware(load("tachobot", assignment)) == role


BALANCING = Path(__file__).parents[2] / "examples/balancing/balancing/board.toml"


@pytest.mark.parametrize("name", ["tachobot", "detective", str(BALANCING)])
def test_the_hardware_is_at_the_end_of_the_role_robot(name: str) -> None:
    board = load(name)
    robot, controller = end_of(board, "robot"), end_of(board, "controller")
    assert robot.has_hardware
    assert not controller.has_hardware
    assert robot.name == board.name
    assert controller.name == f"{board.name}.controller"
    assert robot.components == controller.elsewhere
    assert robot.crossings == controller.crossings


def test_what_the_other_end_has_and_knows_is_not_made_up() -> None:
    results = {
        ("tachobot", "robot"): {},
        ("detective", "controller"): {},
        ("detective", "robot"): {"found": False},
    }
    ends = {}
    for name in ("tachobot", "detective"):
        board = load(name)
        for role in ("robot", "controller"):
            ends[name, role], _ = robot_of(end_of(board, role), board.unconnected())
    for key, result in results.items():
        assert ends[key].own_result() == result
    robot, controller = ends["tachobot", "robot"], ends["tachobot", "controller"]
    assert controller.own_result()["yaw_rad"] is None
    assert (len(robot.probe), len(robot.stop)) == (3, 1)
    assert (controller.probe, controller.stop, controller.still_on) == ((), (), ())
    assert ends["detective", "robot"].ended is not None
    assert ends["detective", "controller"].ended is None


@pytest.mark.parametrize(
    ("roles", "words", "uses"),
    [
        (
            '{left = ["imu"], right = ["thrust_pairs", "controller"]}',
            "all of it in one role",
            (left_end, check_ends),
        ),
        (
            '{left = ["imu", "thrust_pairs", "controller"]}',
            "names every component",
            (left_end, check_ends),
        ),
        (
            '{left = ["imu"], right = ["thrust_pairs"]}',
            "expected two parts",
            (left_end, check_ends),
        ),
        ("{}", "no table", (ends_of,)),
        ('{left = ["imu"]}', "all of it in one role", (ends_of,)),
        ('{eye = ["imu"]}', "hardware at both ends", (role_without_hardware,)),
    ],
)
def test_a_cut_that_cannot_be_is_refused(
    roles: str, words: str, uses: tuple[Callable[[Board], object], ...]
) -> None:
    board = load("tachobot", [f"roles={roles}", "link={}"])
    for use in uses:
        with pytest.raises(ConfigError, match=words):
            use(board)


def test_any_other_cut_is_possible_and_a_role_of_absent_components_no_fault() -> None:
    board = load("tachobot", ['roles={mind = ["controller"]}', "link={}"])
    mind, rest = end_of(board, "mind"), end_of(board, "controller")
    assert (mind.has_hardware, rest.has_hardware) == (False, True)
    assert rest.components == ("thrust_pairs", "imu")
    check_ends(load("tachobot", ['roles={robot = ["imu", "thrust_pairs"], crane = ["lift"]}']))


@pytest.mark.parametrize("name", ["controller", "mind"])
def test_ends_are_told_apart_by_their_hardware_whatever_they_are_called(name: str) -> None:
    roles = "" if name == "controller" else f'{name} = ["controller"], '
    board = load("tachobot", [f'roles={{{roles}robot = ["imu", "thrust_pairs"]}}'])
    assert ends_of(board) == {"robot": "robot", "controller": name}


# Gains --------------------------------------------------------------------------------------------

GAINS = {f"controller.yaw.{key}" for key in ("kp", "ki", "kd", "anti_windup")}
LIMITS = {"thrust_pairs.slew_per_s", "thrust_pairs.timeout_s"}


@pytest.mark.parametrize(
    ("role", "elsewhere", "other"),
    [("robot", GAINS, "x.controller"), ("controller", LIMITS, "x")],
)
def test_gains_are_the_controllers_and_limits_the_robots(
    role: str, elsewhere: set[str], other: str
) -> None:
    board = registry.load("tachobot")
    assert gains_elsewhere(board, end_of(board, role)) == elsewhere
    assert set(tuning_of(board, None, lambda _: None).values) == GAINS | LIMITS, "of a whole robot"
    named = replace(board, name="x")
    assert other_end(named, end_of(named, role)).name == other


def test_a_gain_of_the_other_end_is_refused_with_the_run_that_takes_it_up() -> None:
    board = registry.load("tachobot")
    taken: list[object] = []
    tuning = tuning_of(board, end_of(board, "robot"), taken.append)
    assert set(tuning.values) == LIMITS
    with pytest.raises(ConfigError) as caught:
        tuning.set({"controller.yaw.kp": 0.5, "thrust_pairs.slew_per_s": 5.0})
    [fault] = caught.value.faults
    assert "`set tachobot.controller controller.yaw.kp=VALUE`" in fault
    assert taken == [], "all or none"
    assert tuning.set({"thrust_pairs.slew_per_s": 5.0}) == ["thrust_pairs.slew_per_s"]


@pytest.mark.parametrize("role", ["robot", "controller"])
def test_a_board_without_hardware_at_either_end_has_nothing_to_set(role: str) -> None:
    board = loop_board(registry.load("detective"), 0.01)
    end = loop_end(end_of(board, role))
    assert tuning_of(board, end, lambda _: None).values == {}
    assert other_end(board, end).role == ({"robot", "controller"} - {role}).pop()
