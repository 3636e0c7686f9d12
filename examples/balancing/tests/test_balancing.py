"""The robot, whole, on its doubles in virtual time."""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest

from firmware_runtime import SECOND, ConfigError, OpenBoard, Strike, open_board
from firmware_runtime.board import registry
from firmware_runtime.cli.main import main
from firmware_runtime.lab.campaign import assert_sound
from sim_doubles.faults import FaultScript, NackAddress

IMU = 0x68
GYRO_Y = 4.0
"""Number of its word, after those of the acceleration."""


def on_doubles(settings: Mapping[str, object]) -> OpenBoard:
    """The robot on doubles of its chips, with these settings."""
    return open_board("balancing", doubles=True, clock="virtual", set=settings)


@pytest.mark.parametrize(
    "settings",
    [
        *({"world.start_pitch_rad": start_rad} for start_rad in (-0.1, 0.0, 0.05, 0.1)),
        {"wheels.right.is_reversed": True},  # wheels mounted the other way turn the other way
    ],
)
def test_it_stands_where_it_was_let_go(settings: Mapping[str, object]) -> None:
    with on_doubles(settings) as robot:
        robot.run(6.0)
        assert robot.result["standing"] is True
        assert abs(robot.world.place_m) < 1.1  # the noise of its gyro has it roll about
        assert robot.rig.pwm.warnings == []
        assert robot.rig.imu.warnings == []


def test_it_begins_when_its_outputs_are_enabled_and_the_hand_waits_for_that() -> None:
    with on_doubles({}) as robot:
        parts = robot.model.components
        for name in ("outputs", "left", "right"):
            parts[name].interlock = lambda: robot.now >= 5 * SECOND
        robot.run(4.0)
        assert parts["controller"].components["mode"].phase == "Lying"
        assert robot.outputs == {"wheels": 0}
        assert robot.world.pitch_rad == 0.05
        robot.run(6.0)
        assert robot.result["standing"] is True
        assert not robot.world.has_fallen


def test_a_push_is_taken_up_and_at_the_end_all_outputs_are_off() -> None:
    with on_doubles({}) as robot:
        robot.run(4.0)
        robot.world.push(1.0)
        robot.run(4.0)
        assert robot.result["standing"] is True
        rig = robot.rig
        assert rig.outputs != {"wheels": 0}
    assert rig.outputs == {"wheels": 0}


def test_without_its_motors_it_falls_and_lying_it_leaves_them_alone() -> None:
    with on_doubles({"controller.max_drive": 0.001}) as robot:
        robot.run(4.0)
        assert robot.result["standing"] is False
        assert robot.world.has_fallen
    with on_doubles({"world.start_pitch_rad": 1.2, "world.held_s": 10.0}) as robot:
        robot.run(3.0)
        assert robot.outputs == {"wheels": 0}
        assert robot.model.components["controller"].components["mode"].phase == "Lying"


@pytest.mark.slow
def test_raised_again_it_stands_where_it_was_raised_however_long_it_lay() -> None:
    assert_sound("balancing", [Strike("nack", "imu", at_s=3.0, for_s=1.0)], goes_on=True)
    assert_sound("balancing", [Strike("disarm", at_s=2.0, for_s=3.0)], goes_on=True)


def test_an_imu_that_falls_silent_switches_the_motors_off() -> None:
    with on_doubles({}) as robot:
        silent = NackAddress(address=IMU, times=None, since=3 * SECOND)
        robot.rig.buses["i2c1"].faults = FaultScript([silent])
        robot.run(6.0)
        assert robot.world.has_fallen
        assert robot.outputs == {"wheels": 0}


def test_a_gyro_that_lies_is_contradicted_by_the_speed_it_leads_to_and_the_motors_let_go() -> None:
    lie = Strike("offset", "imu", at_s=2.5, for_s=1.0, amount=GYRO_Y)
    with open_board("balancing", doubles=True, clock="virtual", faults=[lie]) as robot:
        robot.run(3.0)
        assert list(robot.statistics.faults) == ["controller.rolling_check"]
        robot.run(1.0)
        assert not any(robot.rig.outputs.values())


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("wheels.right.pwm_channel=8", "wheels.right"),
        ("imu.sample_hz=100", "imu.sample_hz"),
        ("wheels.address=0x68", "wheels.address"),
        ("controller.period_s=1", "controller.period_s"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(assignment: str, key: str) -> None:
    with pytest.raises(ConfigError) as refused:
        registry.load("balancing", [assignment])
    assert any(fault.startswith(key) for fault in refused.value.faults)


@pytest.mark.slow
def test_its_run_is_its_replay_and_it_rolls_to_where_it_is_to_stand(tmp_path: Path) -> None:
    output, out = tmp_path / "certificate.json", tmp_path / "out"
    words = ("continuity", "balancing", "--for", "3", "--stages", "simulation", "-o", str(output))
    assert main(words) == 0
    stage = json.loads(output.read_text())["stages"]["simulation"]
    assert stage["events"] > 0
    assert stage["identical"] is True
    words = ("experiment", "place-step", "balancing", "--stage", "simulation", "-o", str(out))
    assert main(words) == 0
    found = json.loads((out / "place-step.json").read_text())["ours"]
    assert found["simulation_final_m"] == pytest.approx(0.3, abs=0.03)
    assert found["simulation_settling_s"] < 12
    assert (out / "place-step.html").exists()
