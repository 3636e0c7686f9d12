"""A program that speaks with a running robot: by its socket, by a bridge, by one with a key."""

import os
import signal
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.key_file import write_key
from firmware_runtime.links.ports.ports_client import PortsClient
from firmware_runtime.links.ports.robot_end import NoAnswer
from tests.support.bridged_run import BridgedRun, address, bridged, line, stop

WATCHED = "controller.yaw.command_n"


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[BridgedRun]:
    with bridged(tmp_path) as robot:
        yield robot


def key_in(folder: Path, name: str = "robot.key") -> Path:
    write_key(folder / name)
    return folder / name


MOST = 3000
"""Commands, at 100 Hz, within which the robot has begun to turn to a reference."""


def has_turned(client: PortsClient, reference: float) -> bool:
    """Whether the command that is watched takes the sign of a new reference."""
    client.put("yaw_reference", reference)
    commands = islice(client.watch([WATCHED]), MOST)
    return any(message.value * reference > 0 for message in commands)


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("way", ["socket", "bridge", "key"])
def test_a_value_turns_the_command_that_is_watched(
    robot: BridgedRun, tmp_path: Path, way: str
) -> None:
    run = robot.run()
    line(robot.bridge(), "a run listens")
    key = key_in(tmp_path) if way == "key" else None
    where: str | Path = robot.path
    if way != "socket":
        words = [] if key is None else ["--key", os.fspath(key)]
        bridge = robot.bridge(*words)
        where = "{}:{}".format(*address(bridge))
    with PortsClient(where, key) as client:
        names = {port["name"] for port in client.ports()}
        assert has_turned(client, 3.0)
        assert has_turned(client, -3.0)
        with pytest.raises(ConfigError, match="nothing: no such input port"):
            client.put("nothing", 1)
        with pytest.raises(ConfigError, match="yaw_reference: not a float"):
            client.put("yaw_reference", "fast")
    assert {"yaw_reference", WATCHED} <= names
    assert stop(run, signal.SIGTERM)[0] == 143


@pytest.mark.slow
@pytest.mark.real_time
def test_a_bridge_that_was_started_again_takes_what_the_last_one_would_have(
    robot: BridgedRun, tmp_path: Path
) -> None:
    key = key_in(tmp_path)
    robot.run()
    first = robot.bridge("--key", os.fspath(key))
    host, port = address(first)
    line(first, "a run listens")
    with PortsClient(f"{host}:{port}", key) as client:
        client.put("yaw_reference", 0.5)
        stop(first, signal.SIGTERM)
        second = robot.bridge("--key", os.fspath(key), listen=f"{host}:{port}")
        line(second, "a run listens")
        client.put("yaw_reference", 0.6)


@pytest.mark.slow
@pytest.mark.real_time
def test_without_the_right_key_there_is_no_answer(robot: BridgedRun, tmp_path: Path) -> None:
    robot.run()
    bridge = robot.bridge("--key", os.fspath(key_in(tmp_path)))
    where = "{}:{}".format(*address(bridge))
    line(bridge, "a run listens")
    for key, hint in ((None, True), (key_in(tmp_path, "other.key"), False)):
        with PortsClient(where, key) as client, pytest.raises(NoAnswer) as refused:
            client.put("yaw_reference", 0.5)
        assert ("--key FILE" in str(refused.value)) is hint


def test_what_cannot_be_reached_is_refused_at_once(tmp_path: Path) -> None:
    key = key_in(tmp_path)
    with pytest.raises(ConfigError, match="not on this machine; expected a key file"):
        PortsClient("192.0.2.1:7300")
    with pytest.raises(ConfigError, match="takes no key"):
        PortsClient(tmp_path / "robot.stats", key)
    with PortsClient(tmp_path / "robot.stats") as client, pytest.raises(NoAnswer):
        client.put("yaw_reference", 0.5)
    with PortsClient("127.0.0.1:9") as client, pytest.raises(NoAnswer):
        client.ports()
