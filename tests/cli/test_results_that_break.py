"""A robot or a world that cannot say how a run ended: the rest is printed, the status is kept."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.errors import Status
from sim_doubles.rigs.tachobot import TachobotRig

RUN = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 1)


def _breaks(*_: object) -> dict[str, object]:
    raise KeyError("wheels")


def test_a_world_that_breaks_costs_its_result_and_nothing_else(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(TachobotRig, "result", _breaks)
    ended = command(*RUN)
    assert ended.status == Status.BAD_INPUT
    assert "KeyError: 'wheels'" in ended.error
    assert "outputs still on: none" in ended.out
    assert "activations run, 0 skipped" in ended.out


def test_a_robot_that_breaks_hides_no_output_that_may_be_on(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Robot, "own_result", _raises_a_sentence)
    monkeypatch.setattr(Robot, "make_safe", lambda _robot: ["i2c1 0x40: not acknowledged"])
    ended = command(*RUN, "--json")
    assert ended.status == Status.NOT_SAFE
    assert "not made safe: i2c1 0x40: not acknowledged" in ended.error
    document = json.loads(ended.out)
    assert document["result"] is None
    assert document["statistics"]["models"]["imu"]["scheduled"] > 0


def _raises_a_sentence(robot: Robot) -> dict[str, object]:
    with robot._named("result"):
        return _breaks()


def test_a_world_that_has_no_solution_is_a_model_that_failed(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends(*_: object) -> dict[str, object]:
        raise ModelError("mast.thrust: a step of 1e-10 s")

    monkeypatch.setattr(TachobotRig, "result", ends)
    ended = command(*RUN)
    assert (ended.status, "mast.thrust" in ended.error) == (Status.MODEL_ERROR, True)
