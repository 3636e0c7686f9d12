"""The two ends of a board that runs in two processes: who has the hardware, and what each knows."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.ends import (
    check_ends,
    end_of,
    ends_of,
    gains_elsewhere,
    other_end,
    robot_of,
)
from firmware_runtime.board.registry import Board, load
from firmware_runtime.board.robot import Robot
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.loop_model import loop_board, loop_end
from firmware_runtime.runs.tuning import tuning_of

BALANCING = Path(__file__).parents[2] / "examples/balancing/balancing/board.toml"


def whole(board: Board) -> Robot:
    return board.unconnected()


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


def test_the_end_without_hardware_has_nothing_to_find_and_to_switch_off() -> None:
    board = load("tachobot")
    robot, _ = robot_of(end_of(board, "robot"), whole(board))
    controller, _ = robot_of(end_of(board, "controller"), whole(board))
    assert (len(robot.probe), len(robot.stop)) == (3, 1)
    assert (controller.probe, controller.stop, controller.still_on) == ((), (), ())


def test_what_the_other_end_knows_is_not_made_up() -> None:
    tachobot, detective = load("tachobot"), load("detective")
    for board, role, result in (
        (tachobot, "robot", {}),
        (detective, "controller", {}),
        (detective, "robot", {"found": False}),
    ):
        robot, _ = robot_of(end_of(board, role), whole(board))
        assert robot.own_result() == result
    controller, _ = robot_of(end_of(tachobot, "controller"), whole(tachobot))
    assert controller.own_result()["yaw_rad"] is None


def test_the_robot_s_ending_is_known_where_it_is() -> None:
    board = load("detective")
    assert robot_of(end_of(board, "robot"), whole(board))[0].ended is not None
    assert robot_of(end_of(board, "controller"), whole(board))[0].ended is None


@pytest.mark.parametrize(
    ("roles", "words"),
    [
        (
            '{left = ["imu"], right = ["thrust_pairs", "controller"]}',
            "all of it in one role",
        ),
        ('{left = ["imu", "thrust_pairs", "controller"]}', "names every component"),
        ('{left = ["imu"], right = ["thrust_pairs"]}', "expected two parts"),
    ],
)
def test_a_cut_that_cannot_be_is_refused(roles: str, words: str) -> None:
    board = load("tachobot", [f"roles={roles}", "link={}"])
    with pytest.raises(ConfigError, match=words):
        end_of(board, "left")
    with pytest.raises(ConfigError, match=words):
        check_ends(board)


def test_a_role_of_absent_components_is_no_fault() -> None:
    check_ends(load("tachobot", ['roles={robot = ["imu", "thrust_pairs"], crane = ["lift"]}']))


def test_any_other_cut_is_possible() -> None:
    board = load("tachobot", ['roles={mind = ["controller"]}', "link={}"])
    mind, rest = end_of(board, "mind"), end_of(board, "controller")
    assert (mind.has_hardware, rest.has_hardware) == (False, True)
    assert rest.components == ("thrust_pairs", "imu")


@pytest.mark.parametrize("name", ["controller", "mind"])
def test_ends_are_told_apart_by_their_hardware_whatever_they_are_called(name: str) -> None:
    roles = "" if name == "controller" else f'{name} = ["controller"], '
    board = load("tachobot", [f'roles={{{roles}robot = ["imu", "thrust_pairs"]}}'])
    assert ends_of(board) == {"robot": "robot", "controller": name}


@pytest.mark.parametrize(
    ("roles", "words"),
    [("{}", "no table"), ('{left = ["imu"]}', "all of it in one role")],
)
def test_a_board_that_has_no_two_ends_is_refused(roles: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        ends_of(load("tachobot", [f"roles={roles}", "link={}"]))


# Gains --------------------------------------------------------------------------------------------

GAINS = {f"controller.yaw.{key}" for key in ("kp", "ki", "kd", "anti_windup")}
LIMITS = {"thrust_pairs.slew_per_s", "thrust_pairs.timeout_s"}


@pytest.mark.parametrize(("role", "elsewhere"), [("robot", GAINS), ("controller", LIMITS)])
def test_gains_are_the_controllers_and_limits_the_robots(role: str, elsewhere: set[str]) -> None:
    board = registry.load("tachobot")
    assert gains_elsewhere(board, end_of(board, role)) == elsewhere


@pytest.mark.parametrize(("role", "other"), [("robot", "x.controller"), ("controller", "x")])
def test_the_other_end_goes_by_its_own_name(role: str, other: str) -> None:
    board = registry.load("tachobot")
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


def test_a_whole_robot_takes_up_all_of_them() -> None:
    assert set(tuning_of(registry.load("tachobot"), None, lambda _: None).values) == GAINS | LIMITS
