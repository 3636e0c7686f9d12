"""Gains that are found: they keep the margins, and beat what was there on runs unseen."""

from dataclasses import replace

import pytest
from firmware_boards.tachobot.definition import BOARD
from msgspec import structs

from firmware_runtime.board.registry import load
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.identification.plant import PlantParameters
from firmware_runtime.lab.tuning import search
from firmware_runtime.lab.tuning.loop import Gains
from firmware_runtime.lab.tuning.response import Body, Scenario, stepped
from firmware_runtime.lab.tuning.search import GAIN_DB, PHASE_DEG, tune
from firmware_runtime.lab.tuning.task import loop_of, plant_of_settings, stated_plant, task_of
from tests.support.virtual_tachobot import virtual_tachobot

HEAVY = PlantParameters(0.15, 0.02, 0.01, 0.015, 0.04)


@pytest.mark.slow
def test_gains_for_a_plant_keep_the_margins_and_beat_the_shipped_ones_unseen() -> None:
    board = load("tachobot")
    tuned = tune(task_of(board, HEAVY, {}, 0.001))
    assert tuned.margins.gain_db >= GAIN_DB
    assert tuned.margins.phase_deg >= PHASE_DEG
    assert tuned.seen[1] < tuned.seen[0]
    assert tuned.better >= 0.9 * len(tuned.unseen)


def test_a_delay_of_the_settings_is_part_of_the_loop() -> None:
    board = load("tachobot", ["controller.yaw.delay_s=0.05"])
    task = task_of(board, HEAVY, {"delay_s": (0.03, 0.05)}, 0.001)
    assert task.body.plant.delay_s == pytest.approx(0.09)
    assert all(0.08 <= each.delay_s <= 0.1 for each in task.possible)
    assert task.shipped == Gains(0.75, 0.01, 0.55)


@pytest.mark.slow
def test_the_loop_that_is_searched_on_steps_as_the_robot_on_its_doubles_does() -> None:
    friction = PlantParameters(0.075, 0.02, 0.01, 0.015, 0.01)
    robot = virtual_tachobot(
        "world.yaw_damping_nms=0.02",
        "world.coulomb_friction_nm=0.01",
        "world.static_friction_nm=0.015",
        "world.gyro_noise_rad_s=0.0005",
        "controller.yaw.delay_s=0.03",
    )
    robot.run(6)
    yaw = robot.values("world.yaw_rad")
    body = Body(replace(friction, delay_s=0.04), 0.03, 0.4, 0.8, 0.01)
    found = stepped(body, Gains(0.75, 0.01, 0.55), Scenario(1.0, 5.0, [0.0] * 500)).positions
    # Motors stand still at first on the robot: so far it is behind.
    assert found[20:] == pytest.approx(yaw[20:500], abs=0.05)
    assert found[-1] == pytest.approx(yaw[499], abs=0.01)


def test_the_settings_state_a_plant_where_the_definition_says_how() -> None:
    board = load("tachobot", ["world.static_friction_nm=0.03", "world.coulomb_friction_nm=0.02"])
    assert plant_of_settings(board)[0] == PlantParameters(0.075, 0.0, 0.02, 0.03, 0.01)
    assert board.plant is not None
    silent = structs.replace(board.plant, stated={})
    with pytest.raises(ConfigError, match="tachobot's definition states no numbers of yaw"):
        plant_of_settings(structs.replace(board, plant=silent))
    wrong = structs.replace(board.plant, stated={"inertia": lambda _: 1.0})
    with pytest.raises(ConfigError, match="inertia: unknown key"):
        plant_of_settings(structs.replace(board, plant=wrong))


def test_a_plant_by_hand_has_no_friction_unless_it_is_stated() -> None:
    stated = stated_plant("inertia_kg_m2=0.1, delay_s=0.02", "rotation", "tachobot")
    plant, intervals, noise, doubts = stated
    assert plant == PlantParameters(0.1, 0.0, 0.0, 0.0, 0.02)
    assert (intervals, noise, doubts) == ({}, 0.0, [])
    stuck = stated_plant("mass_kg=3,coulomb_friction_n=0.2", "translation", "mast")[0]
    assert stuck.static == stuck.coulomb


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("inertia=0.1", "unknown key"),
        ("inertia_kg_m2=x", "expected a number"),
        ("delay_s=0.1", "inertia_kg_m2: missing; expected it, and any of damping_nms, coulomb"),
        ("inertia_kg_m2=0", "above 0"),
        ("inertia_kg_m2=1e-300", "1e-09 or more"),
        ("inertia_kg_m2=0.1,inertia_kg_m2=0.2", "stated twice"),
        ("inertia_kg_m2=0.1,delay_s=-1", "0 or more"),
        ("inertia_kg_m2=0.1,static_friction_nm=1,coulomb_friction_nm=2", "at least"),
        ("nowhere.json", "cannot be read"),
        ("no=where.json", "cannot be read"),
    ],
)
def test_what_is_no_plant_is_refused(text: str, expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        stated_plant(text, "rotation", "tachobot")


def test_a_plant_without_a_loop_and_gains_that_may_not_change_are_refused() -> None:
    board = load("tachobot")
    assert BOARD.plant is not None
    with pytest.raises(ConfigError, match="names no loop"):
        loop_of(structs.replace(board, plant=structs.replace(BOARD.plant, loop=None)))
    with pytest.raises(ConfigError, match=r"controller\.yaw\.kp"):
        loop_of(structs.replace(board, retunable=("controller.*.kd",)))


@pytest.mark.slow
def test_margins_that_no_gains_keep_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "PHASE_DEG", 100.0)
    with pytest.raises(ConfigError, match="none found"):
        tune(task_of(load("tachobot"), HEAVY, {}, 0.0))


@pytest.mark.parametrize(
    "stated",
    ["inertia_kg_m2=1e300", "inertia_kg_m2=1e6", "inertia_kg_m2=0.1,delay_s=1e9"],
)
def test_a_plant_too_slow_to_simulate_is_refused(stated: str) -> None:
    plant = stated_plant(stated, "rotation", "tachobot")[0]
    with pytest.raises(ConfigError, match="less inertia, or less delay"):
        tune(task_of(load("tachobot"), plant, {}, 0.0))
