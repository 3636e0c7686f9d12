"""`identify`, `tune` and `sweep`: what they find, write and doubt."""

import json
import os
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from firmware_runtime.board.assignments import set_words
from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.registry import load
from firmware_runtime.cli.commands import tune
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.identification.plant import KEYS, PlantParameters
from firmware_runtime.lab.tuning import search
from firmware_runtime.lab.tuning.task import stated_plant
from firmware_runtime.system.packages import module_of_extra
from tests.support.command import Command, in_python, own_process
from tests.support.made_once import made_once

PLANT = "inertia_kg_m2=0.15,damping_nms=0.02,delay_s=0.03"


@pytest.mark.slow
def test_gains_for_a_stated_plant_are_written_to_a_copy(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 4)
    copy = tmp_path / "tuned.toml"
    ended = command("tune", "tachobot", "--plant", PLANT, "--json", "-o", copy)
    assert (ended.status, ended.error) == (Status.OK, "")
    found = json.loads(ended.out)
    assert found["margins"]["gain_db"] >= 6.0
    assert found["margins"]["phase_deg"] >= 45.0
    assert found["unseen"]["better"] >= 0.9 * found["unseen"]["runs"]
    yaw = load(str(copy)).settings.controller.yaw
    written = {f"controller.yaw.{name}": getattr(yaw, name) for name in ("kp", "ki", "kd")}
    assert written == found["gains"]


@pytest.mark.slow
def test_what_was_found_is_shown_as_a_table_beside_its_doubts(
    command: Command, monkeypatch: pytest.MonkeyPatch, identified: Path
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    shown = command("tune", "tachobot", "--plant", identified).out
    assert "phase margin, deg" in shown
    assert "runs that were not searched on" in shown
    assert f"warning: {WARNING}" in shown


@pytest.mark.slow
def test_a_plant_that_is_not_named_is_that_of_the_settings(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    stated = ("--set", "world.yaw_inertia_kg_m2=0.15", "--plant")
    found = command.document("tune", "tachobot", *stated)
    assert (found["plant"]["inertia_kg_m2"], found["plant"]["delay_s"]) == (0.15, 0.01)
    assert found["margins"]["gain_db"] >= 6.0


def test_the_boards_own_file_is_refused_before_anything_is_searched(
    command: Command,
) -> None:
    own = shipped_file("tachobot")
    before = own.read_bytes()
    assert "tachobot itself" in command.refused("tune", "tachobot", "--plant", PLANT, "-o", own)
    assert own.read_bytes() == before


WARNING = "the plant explains 0% of the output's variance; expected 90 % or more"
VALUES = dict(zip(KEYS["rotation"], (0.15, 0.02, 0.0, 0.0, 0.03), strict=True))


@pytest.fixture
def identified(tmp_path: Path) -> Path:
    """A file as `identify -o` writes it, of another board's run that showed nothing."""
    parameters = {key: {"value": each, "low": each, "high": each} for key, each in VALUES.items()}
    document = {"board": "mast", "parameters": parameters, "noise": {"deviation": 0.0}}
    path = tmp_path / "mast.json"
    path.write_text(json.dumps({**document, "warnings": [WARNING]}))
    return path


def test_a_file_has_the_doubts_of_its_identification_and_its_board(identified: Path) -> None:
    *_, (warned, foreign) = stated_plant(str(identified), "rotation", "tachobot")
    assert (warned, "the plant of mast" in foreign) == (WARNING, True)
    assert stated_plant(str(identified), "rotation", "mast")[3] == [WARNING]


def test_a_plant_may_come_through_a_pipe(identified: Path) -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb"):
        os.write(writing, identified.read_bytes())
        os.close(writing)
        plant, *_, doubts = stated_plant(f"/dev/fd/{reading}", "rotation", "mast")
    assert plant == PlantParameters(*VALUES.values())
    assert doubts == [WARNING]


@pytest.mark.slow
def test_a_run_that_shows_hardly_anything_is_said_too(
    command: Command, monkeypatch: pytest.MonkeyPatch, identified: Path
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    found = json.loads(identified.read_text())["parameters"]
    told = SimpleNamespace(
        parameters={key: SimpleNamespace(**each) for key, each in found.items()},
        plant=PlantParameters(*VALUES.values()),
        noise=0.0,
        warnings=[WARNING],
    )
    monkeypatch.setattr(tune, "identified_from", lambda *_words: (None, told, None))
    document = command.document("tune", "tachobot", "--from", "any")
    assert document["warnings"][0] == WARNING


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
    words += set_words(FRICTION)
    words += [word for each in REFERENCES for word in ("--input", each)]
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder)}
    own_process(*words, check=True, env=environment)
    return folder


@pytest.mark.slow
def test_the_numbers_of_the_world_are_found_in_a_recording(
    command: Command, runs: Path, tmp_path: Path
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
    command: Command, runs: Path, tmp_path: Path
) -> None:
    page = tmp_path / "plant.html"
    words = ("identify", "tachobot", "--json", "--from")
    by_trace = json.loads(command(*words, runs / "run.trace", "-o", page).out)
    assert by_trace == json.loads(command(*words, runs / "run.recording").out)
    assert "Measured and simulated" in page.read_text()


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
        ("time_s,input,output\n" + "0" * 140_000, "neither a recording, a trace nor a table"),
    ],
)
def test_what_is_no_run_is_refused_by_what_is_wrong_with_it(
    command: Command, text: str, expected: str, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    run.write_text(text, encoding="utf-8")
    assert expected in command.refused("identify", "tachobot", "--from", run)


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
    assert in_python(program).returncode == 0


VARY = ("--vary", "world.coulomb_friction_nm=linspace(0, 0.02, 3)", "--set")
WORDS = ("sweep", "tachobot", *VARY, "world.static_friction_nm=0.01", "--for", "1.5")


@pytest.mark.slow
def test_a_table_is_shown_and_each_row_can_be_run_again(command: Command, tmp_path: Path) -> None:
    table, page = tmp_path / "table.csv", tmp_path / "page.html"
    ended = command(*WORDS, "--workers", "1", "-o", table)
    assert (ended.status, ended.out) == (0, f"{table}: 3 runs: 2 ended, 1 refused\n")
    assert ended.error.splitlines()[-1].startswith("3 of 3 runs, 1 failed")

    shown = command("sweep", "show", table)
    assert "3 runs: 2 ended, 1 refused" in shown.out
    assert "did not end in order:\n  row 2: refused, world.static_friction_nm" in shown.out

    found = json.loads(command("sweep", "show", table, "--json").out)
    assert found["outcomes"] == {"ended": 2, "refused": 1}
    assert found["spreads"]["result.yaw_rad"]["count"] == 2
    words = shlex.split(found["worst"]["result.yaw_rad"][0]["command"])
    again = command(*words[1:], "--json")
    assert json.loads(again.out)["result"]["yaw_rad"] == found["spreads"]["result.yaw_rad"]["max"]

    assert command("sweep", "show", table, "-o", page).out == f"{page}\n"
    assert "world.coulomb_friction_nm" in page.read_text()

    for row in (0, 2):
        assert command("sweep", "rerun", table, row).out.endswith("the same as in the table\n")
    table.write_text(table.read_text().replace(",1.5,1.5,", ",1.5,1.25,"))
    other = command("sweep", "rerun", table, 1)
    assert other.status == 1
    assert "duration_s is another: 1.25 in the table, 1.5 now" in other.out


def test_words_that_are_none_are_said_with_all_else_that_is_wrong(command: Command) -> None:
    varied = ("--vary", "x", "--vary", "world.mass_kg=uniform(4,2)", "--vary", "world.no=range(2)")
    for sentence in ("no file for the table", "x: expected KEY", "not below", "--runs: 0"):
        assert sentence in command.refused("sweep", "tachobot", *varied, "--runs", "0")
