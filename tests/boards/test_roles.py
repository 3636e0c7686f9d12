"""Which components of a board play which role."""

import pytest

from firmware_runtime.board.registry import Board, load
from firmware_runtime.board.roles import components_of
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.errors import ConfigError


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


@pytest.mark.parametrize("roles", [{}, {"robot": ("imu",)}])
def test_a_role_that_the_board_has_not_is_refused(roles: dict[str, tuple[str, ...]]) -> None:
    model = model_of(load("tachobot"))
    with pytest.raises(ConfigError, match="pilot: this board has no such role"):
        components_of(roles, model, "pilot")


def test_a_role_without_components_is_refused() -> None:
    model = model_of(load("tachobot"))
    with pytest.raises(ConfigError, match="robot: no component is left"):
        components_of({"robot": ("wheels",)}, model, "robot")
