"""`firmware-runtime send`, `watch` and `show --ports`, on the robot itself and through a bridge."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.links.key_file import write_key
from tests.support.bridged_run import COMMAND, BridgedRun, address, bridged, line, stop
from tests.support.waiting import PATIENCE_S


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[BridgedRun]:
    with bridged(tmp_path) as robot:
        yield robot


def said(robot: BridgedRun, *words: str) -> tuple[int, str, str]:
    """Status, output and errors of a command."""
    done = subprocess.run(
        [*COMMAND, *words],
        env=robot.environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("words", [["send", "tachobot", "a=1"], ["set", "tachobot"]])
def test_a_socket_whose_path_is_too_long_is_said(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / ("long" * 40)))
    assert main(words) == Status.NO_DEVICE
    assert "None" not in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.real_time
def test_values_go_in_and_messages_come_out(robot: BridgedRun, tmp_path: Path) -> None:
    key = tmp_path / "robot.key"
    write_key(key)
    robot.run()
    bridge = robot.bridge("--key", os.fspath(key))
    where = "{}:{}".format(*address(bridge))
    line(bridge, "a run listens")
    for place in (["tachobot"], [where, "--key", os.fspath(key)]):
        sent = said(robot, "send", *place, "yaw_reference=0.5", "yaw_reference=-0.25")
        assert sent == (
            0,
            "yaw_reference: 0.5 has arrived\nyaw_reference: -0.25 has arrived\n",
            "",
        )
        status, printed, _ = said(robot, "watch", *place, "imu.sample", "--count", "3")
        messages = [json.loads(line) for line in printed.splitlines()]
        assert (status, [message["port"] for message in messages]) == (0, ["imu.sample"] * 3)
        assert messages[0]["t_ns"] < messages[2]["t_ns"]
        status, listed, _ = said(robot, "show", *place, "--ports")
        assert (status, "in  yaw_reference: float" in listed.splitlines()) == (0, True)
        status, _, refused = said(robot, "send", *place, "nothing=1")
        assert (status, "nothing: no such input port" in refused) == (2, True)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_watch_goes_on_until_a_signal_or_the_end_of_the_run(robot: BridgedRun) -> None:
    run = robot.run()
    line(robot.bridge(), "a run listens")
    watch = robot.start("watch", "tachobot", "imu.sample", "--every", "10")
    line(watch, "imu.sample")
    assert stop(watch, signal.SIGINT)[0] == 130
    watch = robot.start("watch", "tachobot", "imu.sample", "--every", "10")
    line(watch, "imu.sample")
    stop(run, signal.SIGTERM)
    watch.wait(PATIENCE_S)
    assert watch.returncode == 3
    assert said(robot, "watch", "tachobot", "imu.sample")[0] == 3


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["send", "tachobot", "0.5"], "expected PORT=VALUE"),
        (["send", "tachobot", "a=1", "--key", "/nowhere"], "takes no key"),
        (["send", "127.0.0.1:9", "a=1", "--key", "/nowhere"], "/nowhere: No such file"),
        (["show", "tachobot", "--key", "/nowhere"], "--key: has no effect here"),
        (["send", "192.0.2.1:9", "a=1"], "expected a key file"),
        (["send", "127.0.0.1:99999", "a=1"], "expected ADDRESS:PORT"),
        (["send", "tachobo", "a=1"], "tachobot"),
        (["watch", "tachobot", "a", "--every", "0"], "expected a whole number from 1"),
    ],
)
def test_what_makes_no_sense_is_refused(
    capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    try:
        status = main(words)
    except SystemExit as exit_:
        status = int(exit_.code or 0)
    assert (status, sentence in capsys.readouterr().err) == (2, True)
