"""`send`, `watch`, `show --ports`, `set` and `dover`, on a robot under way."""

import json
import os
import re
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.cli.commands import set as set_verb
from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.links.key_file import write_key
from tests.support.bridged_run import BridgedRun, address, bridged, line, stop
from tests.support.command import Command, own_process
from tests.support.waiting import PATIENCE_S, wait_until

MOST = 3000
"""Commands, at 100 Hz, within which the robot has begun to turn to a reference."""


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[BridgedRun]:
    with bridged(tmp_path) as robot:
        yield robot


def bound(stack: ExitStack) -> socket.socket:
    udp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    udp.bind(("127.0.0.1", 0))
    udp.settimeout(PATIENCE_S)
    return udp


@pytest.mark.slow
@pytest.mark.real_time
def test_a_peer_turns_the_robot_and_sees_its_command_turn(robot: BridgedRun) -> None:
    robot.run()
    line(robot.bridge(), "a run listens")
    with ExitStack() as stack:
        command, rate, free = (bound(stack) for _ in range(3))
        reference_at = free.getsockname()
        free.close()
        dover = robot.start(
            "dover",
            "tachobot",
            "--send",
            f"controller.yaw.command_n={command.getsockname()[1]}",
            "--send",
            f"imu.sample.rate.2={rate.getsockname()[1]}",
            "--take",
            f"yaw_reference={reference_at[1]}",
        )
        line(dover, "carries 2 numbers out and 1 in")
        text = rate.recv(18).decode()
        assert f"{float(text):f}" == text
        for reference in (b"nan", b"left", b"3.000000"):
            command.sendto(reference, reference_at)
        assert any(float(command.recv(18)) > 0 for _ in range(MOST))
        dover.send_signal(signal.SIGSTOP)  # so that it finds these together
        for reference in (b"2.000000", b"-3.000000", b"nan", b"left"):
            command.sendto(reference, reference_at)
        dover.send_signal(signal.SIGCONT)
        assert any(float(command.recv(18)) < 0 for _ in range(MOST))
        status, printed = stop(dover, signal.SIGTERM)
    assert status == 0
    assert printed.count("--take yaw_reference: ") == 1
    assert re.search("taken [12], refused 4", printed)  # of several at once only the last is taken


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_with_the_run_and_names_all_that_the_run_has_not(robot: BridgedRun) -> None:
    run = robot.run()
    line(robot.bridge(), "a run listens")
    wrong = robot.start("dover", "tachobot", "--send", "imu.nothing=1", "--take", "nothing=2")
    printed = wrong.communicate(timeout=PATIENCE_S)[0].decode()
    assert (wrong.returncode, printed.count("--send imu.nothing: no such output port")) == (2, 1)
    assert "--take nothing: no input port of type float" in printed
    dover = robot.start("dover", "tachobot", "--send", "controller.yaw.command_n=62002")
    line(dover, "carries 1 numbers out")
    stop(run, signal.SIGTERM)
    printed = dover.communicate(timeout=PATIENCE_S)[0].decode()
    assert dover.returncode == 3
    assert re.search("dover: sent [0-9]+, taken 0, refused 0", printed)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_signal_that_is_no_number_of_what_comes_is_said_once(robot: BridgedRun) -> None:
    robot.run()
    line(robot.bridge(), "a run listens")
    dover = robot.start("dover", "tachobot", "--send", "imu.sample.rate.7=62905")
    line(dover, "--send imu.sample.rate.7: no number that fits in")
    status, printed = stop(dover, signal.SIGTERM)
    assert status == 0
    assert "no number that fits" not in printed
    assert re.search("sent 0, taken 0, refused [1-9]", printed)


def said(robot: BridgedRun, *words: str) -> tuple[int, str, str]:
    """Status, output and errors of a command."""
    done = own_process(*words, env=robot.environment)
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


def test_without_a_run_there_is_nothing_to_tune(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    assert main(["set", "tachobot"]) not in {Status.OK, None}


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.usefixtures("_run")
def test_safe_state_says_that_a_runs_own_doubles_are_out_of_reach(
    command: Command,
) -> None:
    nowhere = ["--set", "buses.i2c1.device=/nowhere/i2c"]
    said = command.refused("safe-state", "tachobot", *nowhere, status=Status.NOT_SAFE)
    assert "not made safe: i2c1" in said
    assert "is on doubles of its own, which end with it; expected served ones" in said


def test_a_run_that_takes_nothing_up_says_so(
    monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setattr(set_verb, "ask", lambda *_words: {"values": {}})
    assert "taken up by the other role's run" in command.said("set", "tachobot")
    assert json.loads(command.said("set", "tachobot", "--json")) == {}
