"""Which end of a robot in two processes takes a gain up: nothing is set in vain."""

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.ends import end_of, gains_elsewhere, other_end
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.loop_model import loop_board, loop_end
from firmware_runtime.runs.tuning import tuning_of

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
