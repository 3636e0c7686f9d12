"""Gains and limits changed while a robot runs: all of them, or none."""

import pytest
from firmware_boards.detective.definition import BOARD as DETECTIVE
from firmware_boards.tachobot.settings import TachobotSettings

from firmware_runtime.board import registry
from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.tuning import Tuning


@pytest.fixture
def tuning() -> Tuning:
    board = registry.load("tachobot")
    return start_session(board, VirtualClock(), doubles=True, statistics_path=None).tuning


def test_several_values_are_taken_up_at_once(tuning: Tuning) -> None:
    assert tuning.set({"controller.yaw.kp": 0.5, "controller.yaw.ki": 1}) == [
        "controller.yaw.kp",
        "controller.yaw.ki",
    ]
    assert tuning.values["controller.yaw.kp"] == 0.5
    assert tuning.values["controller.yaw.ki"] == 1.0
    assert tuning.revision == 1


def test_with_one_that_is_refused_none_is_taken_up(tuning: Tuning) -> None:
    before = tuning.values
    with pytest.raises(ConfigError) as refused:
        tuning.set({"controller.yaw.kp": 0.5, "controller.yaw.ki": -1.0, "imu.bus": "i2c1"})
    assert [fault.partition(":")[0] for fault in refused.value.faults] == [
        "imu.bus",
        "controller.yaw.ki",
    ]
    assert tuning.values == before
    assert tuning.revision == 0


@pytest.mark.parametrize("value", ["much", True, None, [1.0], {"a": 1}, 1e400, -0.1])
def test_a_value_of_another_type_or_out_of_range_is_refused(tuning: Tuning, value: object) -> None:
    with pytest.raises(ConfigError):
        tuning.set({"controller.yaw.kp": value})


def test_what_the_board_itself_refuses_is_refused(tuning: Tuning) -> None:
    with pytest.raises(ConfigError) as refused:
        tuning.set({"thrust_pairs.timeout_s": 0.001})
    assert "two control periods" in refused.value.faults[0]


def test_a_setting_is_described_by_its_schema() -> None:
    board = registry.load("tachobot")
    found = described(board.settings, board.retunable)
    timeout = found["thrust_pairs.timeout_s"]
    assert (timeout.type, timeout.above, timeout.most) == ("float", 0, 1e9)
    assert "switched off" in timeout.text
    assert found["controller.yaw.anti_windup"].type == "bool"
    assert found["controller.yaw.kp"].range == "from 0"


def test_every_retunable_key_is_described() -> None:
    for name in ("tachobot", "detective"):
        board = registry.load(name)
        found = described(board.settings, board.retunable)
        assert list(found) == list(retunable_values(board.settings, board.retunable))
    assert DETECTIVE.retunable


def test_what_the_robot_fails_to_take_up_is_refused_and_undone() -> None:
    board = registry.load("tachobot")
    taken: list[float] = []

    def retune(settings: TachobotSettings) -> None:
        taken.append(settings.controller.yaw.kp)
        if settings.controller.yaw.kp == 0.5:
            raise KeyError("gone")

    tuning = Tuning(board, retune)
    with pytest.raises(ConfigError) as refused:
        tuning.set({"controller.yaw.kp": 0.5})
    assert refused.value.faults == ("retune: KeyError: 'gone'",)
    assert (taken, tuning.values["controller.yaw.kp"], tuning.revision) == ([0.5, 0.75], 0.75, 0)
    assert tuning.set({"controller.yaw.kp": 0.6}) == ["controller.yaw.kp"]


def test_a_robot_that_takes_up_nothing_any_more_ends_its_run_with_a_sentence() -> None:
    def retune(_: object) -> None:
        raise KeyError("gone")

    with pytest.raises(ModelError, match="its gains are not known any more"):
        Tuning(registry.load("tachobot"), retune).set({"controller.yaw.kp": 0.5})
