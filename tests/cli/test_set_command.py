"""`set`: gains and limits of a run under way."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.cli.commands import set as set_verb
from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from tests.support.bridged_run import BridgedRun, bridged
from tests.support.waiting import wait_until


@pytest.fixture
def _run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[BridgedRun]:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    with bridged(tmp_path) as robot:
        robot.run()
        wait_until(robot.has_begun, "the run has begun")
        yield robot


@pytest.mark.real_time
@pytest.mark.usefixtures("_run")
def test_values_are_shown_changed_and_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["set", "tachobot", "controller.yaw.kp=0.5", "controller.yaw.kd=1"]) == Status.OK
    assert main(["set", "tachobot", "--json"]) == Status.OK
    values = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (values["controller.yaw.kp"], values["controller.yaw.kd"]) == (0.5, 1.0)
    refused = main(["set", "tachobot", "controller.yaw.kp=0.7", "controller.yaw.kd=-1"])
    assert refused == Status.REFUSED
    assert "controller.yaw.kd" in capsys.readouterr().err
    assert main(["set", "tachobot", "controller.yaw.kpp=1"]) == Status.BAD_INPUT
    said = capsys.readouterr().err
    assert "controller.yaw.kpp: unknown key" in said
    assert "did you mean controller.yaw.kp?" in said
    assert main(["set", "tachobot", "controller.period_s=0.02"]) == Status.REFUSED
    assert "controller.period_s: not to be changed while the robot runs" in capsys.readouterr().err
    assert main(["set", "tachobot", "controller.yaw.kp"]) == Status.OK
    assert capsys.readouterr().out.startswith("controller.yaw.kp = 0.5  from 0  ")


@pytest.mark.parametrize(
    "words", [["set", "tachobot", "kp", "a=1"], ["set", "tachobot", "=1"], ["set", "nowhere"]]
)
def test_bad_input_is_refused(words: list[str]) -> None:
    assert main(words) == Status.BAD_INPUT


def test_without_a_run_there_is_nothing_to_tune(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    assert main(["set", "tachobot"]) not in {Status.OK, None}


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.usefixtures("_run")
def test_safe_state_says_that_a_runs_own_doubles_are_out_of_reach(
    capsys: pytest.CaptureFixture[str],
) -> None:
    nowhere = ["--set", "buses.i2c1.device=/nowhere/i2c"]
    assert main(["safe-state", "tachobot", *nowhere]) == Status.NOT_SAFE
    said = capsys.readouterr().err
    assert "not made safe: i2c1" in said
    assert "is on doubles of its own, which end with it; expected served ones" in said


def test_a_run_that_takes_nothing_up_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(set_verb, "ask", lambda *_words: {"values": {}})
    assert main(["set", "tachobot"]) == Status.OK
    assert "taken up by the other role's run" in capsys.readouterr().out
    assert main(["set", "tachobot", "--json"]) == Status.OK
    assert json.loads(capsys.readouterr().out) == {}
