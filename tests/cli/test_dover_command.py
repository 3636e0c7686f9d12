"""`firmware-runtime dover`: a peer of the paper's kind turns a running robot, and sees it turn."""

import re
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from tests.support.bridged_run import BridgedRun, bridged, line, stop
from tests.support.waiting import PATIENCE_S

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


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "expected --send or --take"),
        (["--send", "imu.sample"], "expected NAME=PORT"),
        (["--take", "yaw_reference=70000"], "expected NAME=PORT"),
        (["--take", "a=1", "--take", "a=2"], "a: stated twice"),
        (["--take", "a=1", "--send", "b=1"], "the robot would receive its own"),
    ],
)
def test_what_makes_no_sense_is_refused(
    capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    assert main(["dover", "tachobot", *words]) == 2
    assert sentence in capsys.readouterr().err
