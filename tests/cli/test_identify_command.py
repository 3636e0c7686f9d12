"""`identify`: a robot's numbers from a recording, a trace or a table; what is none is refused."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.system.packages import module_of_extra
from tests.support.made_once import made_once

FRICTION = (
    "world.static_friction_nm=0.03",
    "world.coulomb_friction_nm=0.02",
    "world.yaw_damping_nms=0.02",
    "controller.yaw.reference_rad=0",
    "controller.yaw.ki=0.3",
)
REFERENCES = ("2:yaw_reference=1", "5:yaw_reference=-1", "8:yaw_reference=0.5")
TRUTH = {"inertia_kg_m2": 0.075, "damping_nms": 0.02, "coulomb_friction_nm": 0.02}


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one run of TachoBot against friction: run.recording and run.trace."""
    return made_once(tmp_path_factory, "identify-runs", _make)


def _make(folder: Path) -> Path:
    words = ["run", "tachobot", "--doubles", "--clock", "virtual", "--for", "11"]
    words += ["--record", str(folder / "run.recording"), "--trace", str(folder / "run.trace")]
    words += [word for each in FRICTION for word in ("--set", each)]
    words += [word for each in REFERENCES for word in ("--input", each)]
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder)}
    program = [sys.executable, "-m", "firmware_runtime.cli", *words]
    subprocess.run(program, check=True, capture_output=True, env=environment)
    return folder


@pytest.mark.slow
def test_the_numbers_of_the_world_are_found_in_a_recording(
    command: Callable[..., Any], runs: Path, tmp_path: Path
) -> None:
    written = tmp_path / "plant.json"
    ended = command("identify", "tachobot", "--from", runs / "run.recording", "-o", written)
    assert (ended.status, ended.error) == (Status.OK, "")
    assert "moment of inertia" in ended.out
    found = json.loads(written.read_text())
    assert (found["board"], found["structure"]) == ("tachobot", "rotation")
    for key, truth in TRUTH.items():
        assert found["parameters"][key]["value"] == pytest.approx(truth, rel=0.02)
    static = found["parameters"]["static_friction_nm"]
    assert static["low"] <= 0.03 <= static["high"]
    assert 0.0 < found["parameters"]["delay_s"]["value"] < 0.02


@pytest.mark.slow
def test_a_trace_says_the_same_as_the_recording_of_the_same_run(
    command: Callable[..., Any], runs: Path, tmp_path: Path
) -> None:
    page = tmp_path / "plant.html"
    words = ("identify", "tachobot", "--json", "--from")
    by_trace = json.loads(command(*words, runs / "run.trace", "-o", page).out)
    assert by_trace == json.loads(command(*words, runs / "run.recording").out)
    assert "Measured and simulated" in page.read_text()


@pytest.mark.parametrize("board", ["detective", "balancing", "pan_tilt"])
def test_a_board_without_a_plant_says_so_in_a_sentence(
    command: Callable[..., Any], board: str, tmp_path: Path
) -> None:
    run = tmp_path / "run.csv"
    run.write_text("time_s,input,output\n")
    ended = command("identify", board, "--from", run)
    assert ended.status == Status.BAD_INPUT
    assert "names no plant" in ended.error


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "no column time_s, input, output"),
        ("time_s,input\n0,1\n", "no column output"),
        ("time_s,input,output\n0,x,1\n", "line 2"),
        ("time_s,input,output\n0,1,1\n", "expected 200 or more"),
        ("{}\n", "line 1 is no message of a trace"),
        ('{"t_ns": 1, "port": "a", "value": 1}\n', "nothing of controller.forces"),
        ("\xff\xfe", "no column"),
    ],
)
def test_what_is_no_run_is_refused_by_what_is_wrong_with_it(
    command: Callable[..., Any], text: str, expected: str, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    run.write_text(text, encoding="utf-8")
    ended = command("identify", "tachobot", "--from", run)
    assert ended.status == Status.BAD_INPUT
    assert expected in ended.error


def test_a_file_that_is_not_there_and_an_output_of_another_kind_are_refused(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    missing = tmp_path / "missing"
    assert command("identify", "tachobot", "--from", missing).status == Status.BAD_INPUT
    ended = command("identify", "tachobot", "--from", missing, "-o", tmp_path / "plant.txt")
    assert "expected a name that ends in .json or .html" in ended.error
    ended = command("identify", "tachobot", "--from", missing, "--since", "-1")
    assert "expected a second of the run, 0 or more" in ended.error


def test_without_scipy_the_extra_is_named_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    module = "firmware_runtime.lab.identification.identified"
    for name in [each for each in sys.modules if each.startswith(module.rpartition(".")[0])]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(ConfigError, match="expected the extra tuning"):
        module_of_extra(module, "tuning")


@pytest.mark.slow
def test_no_process_that_runs_a_robot_imports_scipy() -> None:
    program = (
        "import sys; from firmware_runtime.board.registry import load; load('tachobot');"
        "import firmware_runtime.cli.commands.run, firmware_runtime.cli.commands.identify;"
        "sys.exit('scipy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
