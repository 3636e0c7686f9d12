"""The robots' own experiments in simulation: what they find is in their data, and the plant's."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.detective.experiments import figure_6
from firmware_boards.tachobot.experiments import square_wave

from firmware_runtime.board.assignments import set_words
from firmware_runtime.cli.main import main
from tests.support.figure_6 import EVENTS, OUTPUTS

Found = tuple[dict[str, Any], list[dict[str, float]]]


def experiment(name: str, out: Path, *settings: str) -> Found:
    """Figures and data of an experiment of TachoBot's in simulation that ends well."""
    words = ["experiment", name, "tachobot", "--stage", "simulation", "-o", str(out)]
    assert main([*words, *set_words(settings)]) == 0
    rows = csv.DictReader((out / f"{name}.csv").read_text().splitlines())
    data = [{key: float(value) for key, value in row.items()} for row in rows]
    return json.loads((out / f"{name}.json").read_text()), data


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> Found:
    return experiment("square-wave", tmp_path_factory.mktemp("wave") / "out")


@pytest.mark.slow
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


@pytest.mark.slow
def test_without_friction_it_is_never_stuck_away_from_the_reference(tmp_path: Path) -> None:
    none = ("world.static_friction_nm=0", "world.coulomb_friction_nm=0")
    ours = experiment("embedded-step-friction", tmp_path / "out", *none)[0]["ours"]
    assert "release_moment_nm" not in ours or abs(ours["stuck_error_rad"]) < 0.05


@pytest.mark.slow
def test_a_wave_waits_until_the_robot_is_ready(wave: Found, tmp_path: Path) -> None:
    (at_once, early) = wave
    waited, late = experiment("square-wave", tmp_path / "late", "imu.calibration_s=10")
    assert {row["command_n"] for row in late} == {row["command_n"] for row in early}
    largest = "largest_yaw_rad"
    assert waited["ours"][largest] == pytest.approx(at_once["ours"][largest], rel=0.05)


@pytest.mark.slow
def test_without_friction_or_lag_the_robot_is_the_plain_model(wave: Found, tmp_path: Path) -> None:
    figures, data = wave
    assert figures["ours"]["model_yaw_rms_rad"] > 0.1
    assert {row["command_n"] for row in data} == {-0.2, 0.0, 0.2}
    plain = ["world.yaw_damping_nms=0", "world.coulomb_friction_nm=0", "world.static_friction_nm=0"]
    plain += ["world.motor_lag_s=0", "world.gyro_noise_rad_s=0.0005", "thrust_pairs.slew_per_s=1e6"]
    near = experiment("square-wave", tmp_path / "near", *plain)[0]["ours"]
    assert near["model_yaw_rms_rad"] < 0.02
    assert near["model_yaw_rate_rms_rad_s"] < 0.02  # a sample is some ms old


@pytest.mark.slow
def test_a_wave_that_the_outputs_never_followed_is_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(square_wave, "watched_s", lambda _settings: 0.9)
    words = ["--stage", "simulation", "-o", str(tmp_path / "out")]
    assert main(["experiment", "square-wave", "tachobot", *words]) == 2
    assert "the outputs never followed the wave" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


# The detective's ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "equal"),
    [((), 11), (("--set", "model.hop_s=0.02"), 0)],
    ids=["as published", "slow"],
)
def test_every_line_of_figure_6_is_compared(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    changed: Sequence[str],
    equal: int,
) -> None:
    assert (figure_6.EVENTS, list(figure_6.PUBLISHED)) == (EVENTS, OUTPUTS.splitlines())
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))
    words = ["experiment", "figure-6", "detective", "-o", str(tmp_path / "out"), *changed]
    assert main(words) == 0
    assert f"{equal} of 11 output lines are those of Figure 6" in capsys.readouterr().out
    figures = json.loads((tmp_path / "out/figure-6.json").read_text())
    assert figures["figure"] == "Figure 6"
    assert figures["ours"] == {"output_lines": 11, "lines_equal": equal}
    assert figures["paper"] == {"output_lines": 11}


@pytest.mark.slow
def test_a_mission_ends_before_the_target_and_is_drawn(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["experiment", "mission", "detective", "--stage", "simulation", "-o", str(out)]
    assert main(words) == 0
    found = json.loads((out / "mission.json").read_text())["ours"]
    assert found["simulation_found"] == 1
    assert 0.05 < found["simulation_stopped_m"] < 0.5
    assert "The arena from above" in (out / "mission-arena.svg").read_text()
    assert "data:image/svg+xml" in (out / "mission.html").read_text()
