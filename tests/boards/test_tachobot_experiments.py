"""TachoBot's own experiments in simulation: what they find is in their data, and is the plant's."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.tachobot.experiments import square_wave

from firmware_runtime.cli.main import main

pytestmark = pytest.mark.slow


def experiment(name: str, out: Path, *words: str) -> tuple[dict[str, Any], list[dict[str, float]]]:
    """Figures and data of an experiment in simulation that ends well."""
    assert (
        main(["experiment", name, "tachobot", "--stage", "simulation", "-o", str(out), *words]) == 0
    )
    rows = csv.DictReader((out / f"{name}.csv").read_text().splitlines())
    data = [{key: float(value) for key, value in row.items()} for row in rows]
    return json.loads((out / f"{name}.json").read_text()), data


def test_the_robot_is_stuck_while_the_effort_grows_and_is_released(tmp_path: Path) -> None:
    figures, data = experiment("embedded-step-friction", tmp_path / "out")
    ours, paper = figures["ours"], figures["paper"]
    assert paper == {
        "initial_delay_s": 2.0,
        "stuck_from_s": 8.3,
        "stuck_until_s": 10.4,
        "stuck_again_from_s": 20.5,
    }
    assert ours["initial_delay_s"] == pytest.approx(2.0, abs=0.3)
    begin, end = ours["stuck_from_s"], ours["stuck_until_s"]
    inside = [row for row in data if begin + 0.1 <= row["at_s"] < end - 0.1]
    assert len(inside) > 100
    assert {row["true_yaw_rate_rad_s"] for row in inside} == {0.0}
    assert any(
        abs(row["true_yaw_rate_rad_s"]) > 0.02 for row in data if end < row["at_s"] < end + 1
    )
    rise = inside[-1]["effort_n"] - inside[0]["effort_n"]
    span = inside[-1]["at_s"] - inside[0]["at_s"]
    assert ours["effort_slope_n_per_s"] == pytest.approx(rise / span, rel=0.1)
    assert ours["effort_slope_n_per_s"] == pytest.approx(0.2 * ours["stuck_error_rad"], rel=0.05)
    assert ours["release_moment_nm"] == pytest.approx(0.035, rel=0.03)  # world.static_friction_nm
    assert ours["stuck_again_from_s"] > end


def test_without_friction_it_is_never_stuck_away_from_the_reference(tmp_path: Path) -> None:
    none = ("--set", "world.static_friction_nm=0", "--set", "world.coulomb_friction_nm=0")
    figures, _ = experiment("embedded-step-friction", tmp_path / "out", *none)
    assert (
        "release_moment_nm" not in figures["ours"] or abs(figures["ours"]["stuck_error_rad"]) < 0.05
    )


def test_a_wave_waits_until_the_robot_is_ready(tmp_path: Path) -> None:
    at_once, early = experiment("square-wave", tmp_path / "early")
    words = ("--set", "imu.calibration_s=30", "--stage", "simulation")
    waited, late = experiment("square-wave", tmp_path / "late", *words)
    assert {row["command_n"] for row in late} == {row["command_n"] for row in early}
    largest = "largest_yaw_rad"
    assert waited["ours"][largest] == pytest.approx(at_once["ours"][largest], rel=0.05)


def test_a_wave_that_the_outputs_never_followed_is_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(square_wave, "watched_s", lambda _settings: 0.9)
    words = ["--stage", "simulation", "-o", str(tmp_path / "out")]
    assert main(["experiment", "square-wave", "tachobot", *words]) == 2
    assert "the outputs never followed the wave" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_without_friction_or_lag_the_robot_is_the_plain_model(tmp_path: Path) -> None:
    figures, data = experiment("square-wave", tmp_path / "far")
    assert figures["ours"]["model_yaw_rms_rad"] > 0.1
    assert {row["command_n"] for row in data} == {-0.2, 0.0, 0.2}
    plain = ["world.yaw_damping_nms=0", "world.coulomb_friction_nm=0", "world.static_friction_nm=0"]
    plain += ["world.motor_lag_s=0", "world.gyro_noise_rad_s=0.0005", "thrust_pairs.slew_per_s=1e6"]
    words = [word for each in plain for word in ("--set", each)]
    near, _ = experiment("square-wave", tmp_path / "near", *words)
    assert near["ours"]["model_yaw_rms_rad"] < 0.02
    assert near["ours"]["model_yaw_rate_rms_rad_s"] < 0.02  # a sample is some ms old
