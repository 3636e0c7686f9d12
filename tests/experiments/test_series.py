"""`experiment all`: the set, its index and results.json; what fails is said and kept out."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.experiments import Experiment, OwnExperiment
from firmware_runtime.cli.main import main
from firmware_runtime.errors import SettingError, Status
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.view.parts import Series, curve
from tests.support.waiting import PATIENCE_S, wait_until

HERE = "tests.experiments.test_series"


def good(trial: Trial) -> Findings:
    """An experiment that runs nothing."""
    (trial.folder / f"{trial.name}-own.recording").write_text("kept")
    return Findings(
        ours={"delay_ms": 1.5, "never_s": None},
        sentences=["It took 1.5 ms."],
        plots={"": Series("Delay", "s", "ms", [curve("delay", [(0.0, 1.0), (1.0, 2.0)])])},
        data={"": ["at_s,delay_ms", "0,1"], "more": ["a", "1"]},
    )


def bad(trial: Trial) -> Findings:
    """An experiment that fails in the middle."""
    (trial.folder / f"{trial.name}-own.recording").write_text("half")
    raise ZeroDivisionError("of nothing")


def of_another_kind(_trial: Trial) -> object:
    """No findings."""
    return 3


def own(function: str, title: str = "Tried", **what: object) -> OwnExperiment:
    made = OwnExperiment(title=title, run=f"{HERE}:{function}", stages=("simulation",))
    return replace(made, **what)


@pytest.fixture
def tachobot(monkeypatch: pytest.MonkeyPatch) -> dict[str, Experiment]:
    """The experiments that TachoBot has meanwhile."""
    experiments: dict[str, Experiment] = {}
    found = kinds.definition("tachobot")

    def definition(kind: str) -> BoardDefinition[object]:
        assert kind == "tachobot"
        return replace(found, experiments=experiments)

    monkeypatch.setattr(registry, "definition", definition)
    return experiments


def run_all(out: Path) -> int:
    return main(["experiment", "all", "tachobot", "--stage", "simulation", "-o", str(out)])


def test_the_set_has_an_index_and_the_numbers_of_both(
    tachobot: dict[str, Experiment], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tachobot["first"] = own("good", figure="Figure 7", paper={"delay_ms": 7.0})
    tachobot["second"] = own("good")
    out = tmp_path / "a" / "out"
    assert run_all(out) == Status.OK
    assert json.loads((out / "results.json").read_text()) == {
        "first": {"figure": "Figure 7", "ours": {"delay_ms": 1.5}, "paper": {"delay_ms": 7.0}},
        "second": {"figure": "", "ours": {"delay_ms": 1.5}, "paper": {}},
    }
    index = (out / "index.html").read_text()
    assert all(word in index for word in ('"href":"first.html"', "Figure 7", "7 ms", "1.5 ms"))
    files = {"csv", "more.csv", "json", "svg", "html", "recording"}
    expected = {"results.json", "index.html"}
    for name in ("first", "second"):
        ends = {"more.csv": "-more.csv", "recording": "-own.recording"}
        expected |= {name + ends.get(each, f".{each}") for each in files}
    assert {path.name for path in out.iterdir()} == expected
    assert (out / "first.csv").read_text() == "at_s,delay_ms\n0,1\n"
    page = (out / "first.html").read_text()
    assert all(word in page for word in ("first-own.recording", "It took 1.5 ms.", "7 ms"))
    assert "Beside the paper" not in (out / "second.html").read_text()
    assert "[2/2] second" in capsys.readouterr().err


@pytest.mark.parametrize("function", ["bad", "of_another_kind", "absent"])
def test_one_that_fails_is_said_first_and_the_next_is_run(
    tachobot: dict[str, Experiment],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    function: str,
) -> None:
    tachobot["broken"] = own(function, figure="Figure 1", paper={"delay_ms": 7.0})
    tachobot["sound"] = own("good")
    out = tmp_path / "out"
    assert run_all(out) == Status.MODEL_ERROR
    first, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith(f"FAILED broken: experiment {HERE}:{function}: ")
    results = json.loads((out / "results.json").read_text())
    said = results["broken"].pop("failed")
    assert first == f"FAILED broken: {said}"
    assert results["broken"] == {"figure": "Figure 1", "ours": {}, "paper": {"delay_ms": 7.0}}
    assert results["sound"]["ours"] == {"delay_ms": 1.5}
    index = (out / "index.html").read_text()
    assert "1 of 2 experiments failed" in index
    assert not [path for path in out.iterdir() if path.name.startswith((".", "broken"))]
    assert (out / "sound.html").exists()


LACKING = "no-such-package-is-there>=1.13"


def test_one_that_lacks_a_package_is_said_before_any_is_run(
    tachobot: dict[str, Experiment], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tachobot["sound"] = own("good", packages=("msgspec>=0.18",))
    tachobot["lacking"] = own("good", figure="Figure 1", packages=("msgspec", LACKING))
    out = tmp_path / "out"
    assert run_all(out) == Status.MODEL_ERROR
    shown = capsys.readouterr()
    _left_out, said, begun, *_ = shown.err.splitlines()
    why = f"not installed: {LACKING}; expected {sys.executable} -m pip install '{LACKING}'"
    assert said == f"lacking will not be run: {why}"
    assert begun.startswith("[1/1] sound")
    assert shown.out.splitlines()[0] == f"NOT RUN lacking: {why}"
    results = json.loads((out / "results.json").read_text())
    assert results["lacking"] == {"figure": "Figure 1", "ours": {}, "paper": {}, "not_run": why}
    assert results["sound"]["ours"] == {"delay_ms": 1.5}
    index = (out / "index.html").read_text()
    assert "1 of 2 experiments not run" in index
    assert LACKING.replace(">", "\\u003e") in index
    assert not list(out.glob("lacking*"))


@pytest.mark.parametrize("name", ["lacking", "all"])
def test_where_none_can_be_run_nothing_is_touched(
    tachobot: dict[str, Experiment],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    tachobot["lacking"] = own("good", packages=(LACKING,))
    words = ["experiment", name, "tachobot", "--stage", "simulation", "-o", str(tmp_path / "out")]
    assert main(words) == Status.BAD_INPUT
    shown = capsys.readouterr()
    assert f"lacking: not installed: {LACKING}; expected" in shown.err
    assert "will not be run" not in shown.err
    assert (shown.out, list(tmp_path.iterdir())) == ("", [])


def test_one_alone_that_fails_leaves_nothing(
    tachobot: dict[str, Experiment], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tachobot["broken"] = own("bad")
    words = ["experiment", "broken", "tachobot", "-o", str(tmp_path / "out")]
    assert main(words) == Status.BAD_INPUT
    assert "ZeroDivisionError: of nothing" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_files_that_were_there_stay_beside_the_new_ones(
    tachobot: dict[str, Experiment], tmp_path: Path
) -> None:
    tachobot["first"] = own("good")
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_text("kept")
    (out / "first.csv").write_text("old")
    assert main(["experiment", "first", "tachobot", "-o", str(out)]) == Status.OK
    assert (out / "mine.txt").read_text() == "kept"
    assert (out / "first.csv").read_text() != "old"
    assert not list(out.glob(".*"))


@pytest.mark.parametrize("name", ["all", "Yaw", "a/b", "-a", "a--b", ""])
def test_a_name_that_no_file_should_have_is_refused(name: str) -> None:
    found = kinds.definition("tachobot")
    with pytest.raises(SettingError):
        replace(found, experiments={name: own("good")})
    with pytest.raises(SettingError):
        replace(found, experiments={"sound": replace(own("good"), run="no words for a function")})
    with pytest.raises(SettingError):
        replace(found, experiments={"sound": own("good", packages=("--editable .",))})


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("stage", ["embedded", "network"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_without_a_trace(
    tmp_path: Path, stage: str, number: signal.Signals
) -> None:
    words = ["experiment", "yaw-step", "tachobot", "--stage", stage, "-o", str(tmp_path / "out")]
    place = tmp_path / "temporary"
    place.mkdir()
    with subprocess.Popen(
        [sys.executable, "-m", "firmware_runtime.cli", *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env=os.environ | {"TMPDIR": str(place)},
        text=True,
    ) as process:
        try:
            wait_until(lambda: bool(list(tmp_path.glob("**/*.recording"))), "a run is recorded")
            process.send_signal(number)
            _, error = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    expected = Status.INTERRUPTED if number is signal.SIGINT else Status.TERMINATED
    assert process.returncode == expected, error
    assert "Traceback" not in error
    assert [path.name for path in tmp_path.iterdir()] == ["temporary"]
    assert list(place.iterdir()) == []
