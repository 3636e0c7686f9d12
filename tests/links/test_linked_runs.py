"""A board in two processes: it works as in one, and is driven only while both are there."""

import signal
import socket
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import Status
from firmware_runtime.links.control import ask
from firmware_runtime.links.key_file import write_key
from sim_doubles.chips.pca9685_registers import STEPS
from tests.support.linked_runs import free_port, linked
from tests.support.virtual_detective import NEAR
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


FLOOD = (b"noise", b"FWL1\x02" + bytes(170), b"FWL1\x02" + bytes(9000), b"FWL1\x02")


@pytest.fixture(params=["unix", "udp", "udp with a key"])
def link(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """What both ends are given by `--link`."""
    if request.param == "unix":
        return f"unix:{tmp_path}/link"
    if request.param == "udp":
        return f"udp:127.0.0.1:{free_port()}"
    write_key(tmp_path / "key")
    return f"udp:127.0.0.1:{free_port()},key={tmp_path}/key"


def test_tachobot_settles_with_its_controller_in_another_process(link: str, tmp_path: Path) -> None:
    with linked(tmp_path, "tachobot", link) as runs:
        for for_s in ("6", "60"):  # on a busy machine silences may have disarmed it meanwhile
            controller = runs.controller()
            controller.wait_until_it_has_run(1)  # so that all of the robot's time is controlled
            robot = runs.robot("--for", for_s)
            ended, other = robot.report(), controller.report()
            if ended["result"]["settled"]:
                break
    assert ended["status"] == other["status"] == 0
    assert ended["result"]["settled"] is True
    assert ended["outputs_on"] == {"thrust_pairs": 0}
    assert other["ended"]["reason"] == ended["ended"]["reason"]
    assert "controller.yaw" in other["statistics"]["models"]
    assert "controller.yaw" not in ended["statistics"]["models"]
    assert other["statistics"]["bus"] == {}
    for counted in (ended["link"], other["link"]):
        assert min(counted["sent"], counted["received"]) > 100
        assert counted["age_us"]["max"] > 0
        refused = {reason for reason, count in counted["refused"].items() if count > 0}
        assert refused <= {"too_old"}, "and that on a busy machine alone, as silences"


def test_a_controller_that_comes_late_gets_what_was_said_once_and_ends_with_its_robot(
    tmp_path: Path,
) -> None:
    with linked(tmp_path, "detective", f"udp:127.0.0.1:{free_port()}") as runs:
        robot = runs.robot(*NEAR)
        robot.wait_until_it_has_run(2 * SECOND)  # the signal to start leaves after 0.5 s
        controller = runs.controller()
        ended, other = robot.report(), controller.report()
    assert ended["result"]["found"] is True
    assert ended["ended"]["reason"] == other["ended"]["reason"] == "the target was reached"
    assert other["result"] == {}, "what only the other end knows"


def test_a_controller_that_stands_still_disarms_the_robot_until_it_is_back(
    link: str, tmp_path: Path
) -> None:
    with linked(tmp_path, "tachobot", link) as runs:
        robot, controller = runs.robot("--for", "600"), runs.controller()
        robot.wait_until_armed()
        controller.process.send_signal(signal.SIGSTOP)
        robot.wait_until_armed(armed=False)
        controller.process.send_signal(signal.SIGCONT)
        robot.wait_until_armed()
        robot.process.send_signal(signal.SIGTERM)
        said = robot.report()["said"]
    assert "disarmed: the controller has been silent" in said


def test_either_end_may_be_killed_and_started_again(link: str, tmp_path: Path) -> None:
    with linked(tmp_path, "tachobot", link) as runs:
        robot, controller = runs.robot("--for", "600"), runs.controller()
        robot.wait_until_armed()
        controller.kill()
        robot.wait_until_armed(armed=False)
        controller = runs.controller()
        robot.wait_until_armed()
        robot.kill()
        robot = runs.robot("--for", "600")
        robot.wait_until_armed()
        assert controller.process.poll() is None


def test_a_controller_that_is_stopped_says_so(tmp_path: Path) -> None:
    with linked(tmp_path, "tachobot", f"unix:{tmp_path}/link") as runs:
        robot, controller = runs.robot("--for", "600"), runs.controller()
        robot.wait_until_armed()
        controller.process.send_signal(signal.SIGTERM)
        controller.report()
        robot.wait_until_armed(armed=False)
        assert robot.process.poll() is None, "it waits for the next"
        robot.process.send_signal(signal.SIGTERM)
        said = robot.report()["said"]
    assert "disarmed: the controller has ended: SIGTERM" in said


def test_a_robot_of_another_package_runs_in_two_processes(tmp_path: Path) -> None:
    with linked(tmp_path, "balancing", f"udp:127.0.0.1:{free_port()}") as runs:
        controller = runs.controller()
        controller.wait_until_it_has_run(1)  # so that all of the robot's time is controlled
        robot = runs.robot("--for", "3")
        ended, other = robot.report(), controller.report()
    assert ended["status"] == other["status"] == 0
    assert ended["link"]["received"] > 0
    assert sum(ended["outputs_on"].values()) == 0


def test_it_is_armed_on_request_only_while_the_link_is_good(tmp_path: Path) -> None:
    with linked(tmp_path, "tachobot", f"unix:{tmp_path}/link") as runs:
        terms = ("--supervised", "--set", "arming.demand_guard=false")
        unjudged = ("--set", "arming.max_late_percent=100.0", "--set", "executive.fifo_priority=0")
        robot = runs.robot("--for", "600", *terms, *unjudged)
        control = robot.statistics
        robot.wait_until_it_has_made(steps=1)
        refused = ask(control, "arm")["refused"]
        assert any("the link is not good" in why for why in refused)
        controller = runs.controller()
        wait_until(lambda: ask(control, "arm")["armed"], "armed", lambda: str(refused))
        controller.kill()
        robot.wait_until_armed(armed=False)
        runs.controller()
        robot.wait_until_armed()
        assert ask(control, "disarm")["armed"] is False


def test_each_end_is_spoken_to_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    with linked(tmp_path, "tachobot", f"unix:{tmp_path}/link") as runs:
        robot, controller = runs.robot("--for", "600"), runs.controller()
        robot.wait_until_armed()
        controller.wait_until_it_has_run(1)
        assert main(["show", "tachobot.controller", "--ports"]) == Status.OK
        assert "in  yaw_reference: float" in capsys.readouterr().out
        assert main(["send", "tachobot.controller", "yaw_reference=0.5"]) == Status.OK
        watched = ["watch", "tachobot.controller", "controller.yaw.command_n", "--count", "1"]
        assert main(watched) == Status.OK
        assert main(["set", "tachobot.controller", "controller.yaw.kp=0.5"]) == Status.OK
        assert main(["set", "tachobot.controller", "controller.yaw.kp"]) == Status.OK
        assert "controller.yaw.kp = 0.5 " in capsys.readouterr().out
        assert main(["set", "tachobot", "controller.yaw.kp=0.5"]) == Status.REFUSED
        assert "`set tachobot.controller controller.yaw.kp=VALUE`" in capsys.readouterr().err
        assert main(["set", "tachobot", "controller.yaw.kp"]) == Status.BAD_INPUT
        assert "this run does not take it up" in capsys.readouterr().err
        assert main(["show", "tachobot.pilot", "--ports"]) == Status.BAD_INPUT
        assert "pilot: this board has no such role" in capsys.readouterr().err
        assert main(["show", "tachobot.robot", "--ports"]) == Status.OK


def test_a_flooded_robot_stays_armed(tmp_path: Path) -> None:
    """2000 datagrams a second that no key has signed, for 2 s: with each step of the robot 20."""
    write_key(tmp_path / "key")
    port = free_port()
    with (
        linked(tmp_path, "tachobot", f"udp:127.0.0.1:{port},key={tmp_path}/key") as runs,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attacker,
    ):
        runs.controller().wait_until_it_has_run(1)
        robot = runs.robot()
        robot.wait_until_armed()
        armed = 0
        for _ in range(200):
            made = robot.cell(STEPS)
            armed += robot.is_armed
            for _ in range(5):
                for datagram in FLOOD:
                    attacker.sendto(datagram, ("127.0.0.1", port))
            robot.wait_until_it_has_made(made + 1)
        assert armed > 100, "a busy machine may silence the controller now and then"
        robot.process.send_signal(signal.SIGTERM)
        assert robot.report()["link"]["refused"]["forged"] > 0
