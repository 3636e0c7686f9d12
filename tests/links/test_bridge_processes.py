"""A robot on doubles and its bridge as processes, spoken with over UDP."""

import json
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.links.ports.datagrams import GREETING
from firmware_runtime.statistics.paths import Companion
from tests.support.bridged_run import BridgedRun, address, bridged, line, stop
from tests.support.waiting import PATIENCE_S, wait_until

DOCUMENT = Path(__file__).parents[2] / "docs" / "bridge.md"

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[BridgedRun]:
    with bridged(tmp_path) as robot:
        yield robot


def end_of(run: "subprocess.Popen[bytes]") -> dict[str, Any]:
    """What a run says that is to stop; all is accounted for, and everything is off."""
    status, out = stop(run, signal.SIGTERM)
    assert status == 143, out
    report: dict[str, Any] = json.loads(out)
    counted = report["statistics"]
    assert counted["scheduled"] == counted["run"] + counted["skipped"] + counted["coalesced"]
    assert report["outputs_on"] == {"thrust_pairs": 0}
    return report


def test_a_reference_set_over_udp_turns_the_command_and_each_sender_is_answered_alone(
    robot: BridgedRun,
) -> None:
    run, bridge = robot.run(), robot.bridge()
    where = address(bridge)
    talker, other = robot.talker(where), robot.talker(where)
    line(bridge, "a run listens")
    other.say({"port": "nothing", "value": 1})
    ports = talker.ask({"list": True})["ports"]
    assert {"name": "yaw_reference", "direction": "in", "type": "float"} in ports
    assert {"name": "imu.sample", "direction": "out", "type": "InertialSample"} in ports
    assert "no such input port" in other.receive()["error"]
    assert talker.ask({"list": True})["counts"]["refused"] == 1
    watched = ["controller.yaw.command_n"]
    assert talker.ask({"watch": watched}) == {"watching": watched, "for_s": 10}
    received = [talker.receive()]
    for reference in (3, -3):  # it commands no more than noise where it has arrived
        talker.say({"port": "yaw_reference", "value": reference})
        while received[-1]["value"] * reference < 1:
            received.append(talker.receive())
    assert {message["port"] for message in received} == {*watched}
    instants = [message["t_ns"] for message in received]
    assert instants == sorted(set(instants))
    process = Path("/proc", str(run.pid))
    before = sockets_of(process)
    unix = {row.split()[6] for row in (process / "net" / "unix").read_text().splitlines()[1:]}
    lasting = before & sockets_of(process)
    assert lasting
    assert lasting <= unix, "the run itself knows nothing of UDP"
    assert stop(bridge, signal.SIGTERM)[0] == 0
    end_of(run)


def test_peers_receive_without_asking_across_a_restart_of_the_run(robot: BridgedRun) -> None:
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as peer:
        peer.bind(("::1", 0))
        peer.settimeout(PATIENCE_S)
        peer_at = f"[::1]:{peer.getsockname()[1]}"
        words = ("--peer", peer_at, "--watch", "imu.sample", "--every", "5")
        bridge = robot.bridge(*words, listen="[::1]:0")
        talker = robot.talker(address(bridge))
        line(bridge, r"no run listens \(No such file or directory\); waiting for one")
        assert "no run listens" in talker.ask({"list": True})["error"]
        first = robot.run()
        line(bridge, "a run listens")
        instants = [json.loads(peer.recv(65536))["t_ns"] for _ in range(3)]
        gaps = [later - earlier for earlier, later in pairwise(instants)]
        assert all(gap >= 50_000_000 and gap % 10_000_000 == 0 for gap in gaps)
        first.kill()
        first.wait()
        line(bridge, r"no run listens \(Connection refused\)")
        assert "Connection refused" in talker.ask({"list": True})["error"]
        robot.run()
        line(bridge, "a run listens")
        peer.setblocking(False)
        while has_more(peer):
            pass
        peer.settimeout(PATIENCE_S)
        assert json.loads(peer.recv(65536))["port"] == "imu.sample"
        assert talker.ask({"list": True})["counts"]["received"] >= 1
        assert stop(bridge, signal.SIGINT) == (0, "")


def has_more(peer: socket.socket) -> bool:
    """Whether a message of the first run was left; it is taken."""
    try:
        return bool(peer.recv(65536))
    except BlockingIOError:
        return False


def test_a_port_that_is_not_there_is_reported_once(robot: BridgedRun) -> None:
    robot.run()
    bridge = robot.bridge("--peer", "127.0.0.1:9", "--watch", "imu.nothing")
    refused = line(bridge, "the run refuses")
    assert "imu.nothing: no such output port; expected one that" in refused
    assert "refuses" not in stop(bridge, signal.SIGTERM)[1]


def test_ten_thousand_datagrams_and_a_deaf_watcher_leave_the_run_as_it_is(
    robot: BridgedRun,
) -> None:
    # each number is a step: on a slow machine so many are more than it keeps up with
    run, bridge = robot.run("--set=executive.max_lag_s=10"), robot.bridge()
    talker = robot.talker(address(bridge))
    line(bridge, "a run listens")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as deaf:
        deaf.settimeout(PATIENCE_S)
        deaf.connect(str(Companion.SOCKET.beside(robot.path)))
        assert deaf.recv(100) == GREETING
        said: dict[str, object] = {"watch": ["imu.sample", "controller.forces"]}
        for number in range(10_001):
            deaf.send(json.dumps(said).encode())
            value = number / 1e5 if number % 2 else "not a number"
            said = {"port": "yaw_reference", "value": value}

        counts: dict[str, int] = {}

        def has_come() -> bool:
            counts.update(talker.insist({"list": True}, "counts"))
            return counts["refused"] >= 5000 and counts["received"] > 10_001

        wait_until(has_come, "all has come", lambda: str(counts))
        assert counts["refused"] == 5000
        assert counts["dropped"] > 4000
        assert talker.insist({"watch": ["imu.sample"]}, "watching") == ["imu.sample"]
        received = [talker.receive() for _ in range(20)]
    samples = [message for message in received if "watching" not in message]  # answered twice
    assert {message["port"] for message in samples} == {"imu.sample"}
    statistics = end_of(run)["statistics"]
    assert statistics["run"] > 0
    assert statistics["conditions"]["run"]["inputs_dropped"] == 0


def sockets_of(process: Path) -> set[str]:
    """The inodes of a process's sockets, given its folder in /proc."""
    inodes = set()
    for descriptor in (process / "fd").iterdir():
        with suppress(FileNotFoundError):  # closed since they were listed
            found = re.fullmatch(r"socket:\[(\d+)\]", str(descriptor.readlink()))
            inodes |= {found[1]} if found else set()
    return inodes


def reported_until(manager: socket.socket, last: str) -> list[str]:
    """What systemd receives, up to this; one of the next hundred."""
    reported: list[str] = []
    for _ in range(100):
        reported.append(manager.recv(4096).decode())
        if reported[-1] == last:
            return reported
    raise AssertionError(f"never reported: {last!r}, but {reported}")


def test_systemd_learns_that_it_is_ready_alive_and_how_it_goes(
    robot: BridgedRun, tmp_path: Path
) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(PATIENCE_S)
        bridge = robot.bridge(NOTIFY_SOCKET=str(tmp_path / "notify"), WATCHDOG_USEC="1000000")
        ready = reported_until(manager, "STATUS=no run; senders 0, to it 0, from it 0, dropped 0")
        assert "READY=1" in ready
        assert "WATCHDOG=1" in [*ready, *reported_until(manager, "WATCHDOG=1")]
        bridge.send_signal(signal.SIGTERM)
        reported_until(manager, "STOPPING=1")
    bridge.communicate(timeout=PATIENCE_S)
    assert bridge.returncode == 0


def test_the_example_of_the_document_works(robot: BridgedRun) -> None:
    (example,) = re.findall(
        r"<!-- run by tests/links -->\n```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL
    )
    robot.run()
    bridge = robot.bridge()
    _, port = address(bridge)
    line(bridge, "a run listens")
    assert "7300" in example
    printed = subprocess.check_output(
        [sys.executable, "-c", example.replace("7300", str(port))], text=True, timeout=PATIENCE_S
    )
    first, *messages = printed.splitlines()
    assert first == '{"watching":["controller.yaw.command_n"],"for_s":10}'
    assert len(messages) == 3
    assert all(re.fullmatch(r"\d+\.\d\d s  [+-]\d\.\d{3} N", message) for message in messages)
