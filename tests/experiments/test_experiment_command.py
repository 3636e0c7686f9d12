"""`experiment`: what it takes, and that its files hold what they say."""

import csv
import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.lab.experiments.loop_experiment import Round, delays_of, rounds_of, settled
from firmware_runtime.lab.quantile import quantile


def run(*words: object) -> int:
    try:
        return main([str(word) for word in words])
    except SystemExit as ended:
        return int(ended.code or 0)


@pytest.mark.parametrize(
    ("words", "faults"),
    [
        (("yaw-stepp", "tachobot", "-o", "out"), 1),
        (("yaw-step", "detective", "-o", "out"), 1),
        (("loop-delay", "tachobot", "--stage", "embedded", "-o", "out"), 1),
        (("yaw-step", "tachobot", "--for", "3", "-o", "out"), 1),
        (("yaw-step", "tachobot", "-o", "file"), 1),
        (("yaw-step", "tachobot", "-o", "file/out"), 1),
        (("yaw-step",), 1),
        (("yaw-step", "tachobot", "--every", "0.01", "-o", "out"), 1),
        (("loop-delay", "tachobot", "--every", "1e-9", "-o", "out"), 1),
        (("yaw-step", "tachobot", "--peer", "h:1", "--key", "k", "-o", "out"), 1),
        (("loop-delay", "tachobot", "--stage", "remote", "--peer", "h:1", "-o", "out"), 1),
        (("loop-delay", "tachobot", "--impair", "loss=2", "-o", "out"), 1),
        (("yaw-step", "tachobot", "--stage", "network", "--impair", "loss=2%", "-o", "out"), 1),
        (("yaw-step", "tachobot", "--stage", "remote", "--link", "ros2", "-o", "out"), 1),
    ],
)
def test_what_cannot_be_tried_is_refused(
    words: tuple[str, ...],
    faults: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    assert run("experiment", *words) == 2
    assert f"{faults} fault" in capsys.readouterr().err
    assert not Path("out").exists()


def test_an_unknown_stage_is_refused() -> None:
    assert run("experiment", "yaw-step", "tachobot", "--stage", "orbit", "-o", "out") == 2


def test_the_list_names_what_boards_offer(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("experiment") == 0
    every = capsys.readouterr().out.splitlines()
    assert "yaw-step tachobot: Step of the yaw reference (Figure 10)" in every
    assert any(line.startswith("loop-delay detective: ") for line in every)


@pytest.mark.slow
def test_a_step_in_simulation_leaves_data_figures_a_plot_and_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("experiment", "yaw-step", "tachobot", "--stage", "simulation", "-o", out) == 0
    printed = capsys.readouterr().out.splitlines()
    texts = ["yaw-step.csv", "yaw-step.json", "yaw-step.svg", "yaw-step-angular-speed.svg"]
    names = [*texts, "yaw-step-simulation.recording", "yaw-step.html"]
    assert printed[1:] == [str(out / name) for name in names]
    rows = list(csv.DictReader((out / "yaw-step.csv").read_text().splitlines()))
    assert {row["stage"] for row in rows} == {"simulation"}
    at, yaw = ([float(row[name]) for row in rows] for name in ("since_step_s", "yaw_rad"))
    assert at == sorted(at)
    assert abs(yaw[0]) < 0.01
    assert 0.9 < yaw[-1] < 1.1
    found = json.loads((out / "yaw-step.json").read_text())
    response = found["stages"]["simulation"]["response"]
    assert response["samples"] == sum(float(row["since_step_s"]) >= 0 for row in rows)
    assert response["final"] == yaw[-1]
    assert 0.5 < response["rise_s"] < 2.0
    assert found["conditions"].keys() >= {"machine", "kernel", "python"}
    assert any("Figures 10 and 11" in sentence for sentence in found["published"])
    picture = ET.parse(out / "yaw-step.svg")  # noqa: S314 -- of our own
    words = {each.text for each in picture.iter("{http://www.w3.org/2000/svg}text")}
    assert {"simulation", "reference"} <= words
    page = (out / "yaw-step.html").read_text()
    assert "Figures 10 and 11" in page
    assert '"name":"reference"' in page


# Delays -------------------------------------------------------------------------------------------

ROUNDS = [
    Round(0.01, 1.0, 1.002, 1.005),
    Round(0.02, 2.0, 2.003, 2.004),
    Round(0.03, 3.0, None, None),
    Round(0.04, 4.0, 4.001, None),
]


def test_delays_are_of_what_came_back() -> None:
    found = delays_of(ROUNDS)
    assert (found.sent, found.back) == (4, 2)
    assert found.p50_ms == pytest.approx(4.0)
    assert found.p99_ms == found.most_ms == pytest.approx(5.0)
    assert found.least_ms == pytest.approx(4.0)
    assert found.out_p50_ms == pytest.approx(2.0)
    assert found.return_p50_ms == pytest.approx(1.0)
    nothing = delays_of(ROUNDS[2:])
    assert (nothing.back, nothing.p50_ms, nothing.return_p50_ms) == (0, None, None)


def test_rounds_before_the_link_was_up_and_the_last_second_are_left_out() -> None:
    late = [Round(at, at, None if at < 2 else at, None if at < 2 else at) for at in range(6)]
    assert [each.value for each in settled(late)] == [3, 4]
    assert settled([]) == []


def test_quantiles_are_samples() -> None:
    ordered = [float(number) for number in range(1, 101)]
    assert [quantile(ordered, share) for share in (0.0, 0.5, 0.99, 1.0)] == [1, 50, 99, 100]
    assert quantile([], 0.5) is None


def test_rounds_are_read_from_a_merged_trace(tmp_path: Path) -> None:
    messages = [
        (1_000, "ramp.value", 0.01),
        (2_000, "echo.back", 0.01),
        (2_500, "ramp.value", 0.02),
        (3_000, "probe.back", 0.01),
        (4_000, "imu.sample", 0.01),
        (5_000, "probe.back", 0.01),
    ]
    trace = tmp_path / "trace"
    lines = (json.dumps({"t_ns": at, "port": port, "value": each}) for at, port, each in messages)
    trace.write_text("\n".join(lines))
    assert rounds_of(trace) == [
        Round(0.01, 1e-6, 2e-6, 3e-6),
        Round(0.02, 2.5e-6, None, None),
    ]
