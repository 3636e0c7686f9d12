"""Values of ports over Foxglove's protocol, as a viewer gets them."""

import asyncio
import json
import socket
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.live.foxglove import LOOPBACK, FoxgloveChannels, schema_of, topic_of
from firmware_runtime.live.observed import Observed
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.recording.exports.typed_values import Port, ports_of
from tests.support.command import Command
from tests.support.foxglove_viewer import viewed, viewer_of
from tests.support.recorded import record

COMMAND, YAW = "controller.yaw.command_n", "controller.attitude.yaw"
BEGAN = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def ports() -> Mapping[str, Port]:
    return ports_of(registry.load("tachobot").unconnected().model)


async def first_value(
    served: FoxgloveChannels, path: str, value: object, topic: str
) -> tuple[dict[str, Any], dict[str, Any], tuple[int, Any]]:
    """What the server says of itself, of a topic, and what a viewer of it gets of a value."""
    async with viewer_of(f"ws://{LOOPBACK}:{served.port}") as viewer:
        info = await viewer.said("serverInfo")
        channel = await viewer.subscribe(topic)
        got = asyncio.ensure_future(viewer.value())
        at = BEGAN
        while not got.done():  # until it has subscribed
            served.send(path, at := at + 1, value)
            await asyncio.wait([got], timeout=0.01)
        return info, channel, got.result()


@pytest.mark.slow
def test_a_viewer_gets_channels_schemas_and_values(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, port=0) as served:
        topic = topic_of("tachobot", COMMAND)
        assert topic == "/tachobot/ports/controller/yaw/command_n"
        info, channel, (at, value) = viewed(first_value(served, COMMAND, 0.25, topic))
    assert info["name"] == "tachobot"
    assert info["capabilities"] == []  # it may look and nothing else
    assert (channel["encoding"], channel["schemaEncoding"]) == ("json", "jsonschema")
    assert json.loads(channel["schema"])["properties"] == {"value": {"type": "number"}}
    assert value == {"value": 0.25}
    assert BEGAN < at < BEGAN + 10**9


@pytest.mark.slow
def test_a_record_has_its_fields(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, port=0) as served:
        topic = topic_of("tachobot", YAW)
        _, channel, (_, value) = viewed(first_value(served, YAW, Motion(1.0, 0.5), topic))
    assert value == {"position": 1.0, "rate": 0.5}
    assert channel["schemaName"] == "Motion"


@pytest.mark.slow
def test_a_port_of_the_world_has_any_value(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, port=0) as served:
        served.send("world.yaw_rad", 1, 0.5)
        topic = topic_of("tachobot", "world.yaw_rad")
        _, channel, (_, value) = viewed(first_value(served, "world.yaw_rad", 0.5, topic))
    assert value == {"value": 0.5}
    assert channel["schema"] == ""


def test_what_nobody_looks_at_is_not_sent(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, port=0) as served:
        served.send(COMMAND, 1, 0.25)
        served.close()  # again does nothing


@pytest.mark.slow
def test_who_comes_later_gets_what_was_sent_last(ports: Mapping[str, Port]) -> None:
    async def looked_at_late(served: FoxgloveChannels) -> tuple[int, Any]:
        async with viewer_of(f"ws://{LOOPBACK}:{served.port}") as viewer:
            await viewer.subscribe(topic_of("tachobot", COMMAND))
            return await viewer.value()

    with FoxgloveChannels("tachobot", ports, port=0) as served:
        served.send(COMMAND, BEGAN, 0.25)
        served.send(COMMAND, BEGAN + 1, 0.5)
        assert viewed(looked_at_late(served)) == (BEGAN + 1, {"value": 0.5})


@pytest.mark.slow
def test_all_that_is_observed_is_handed_on_with_its_instant(tmp_path: Path) -> None:
    path = record(tmp_path / "x.recording", "tachobot", 1.0)
    seen: list[tuple[int, str, object]] = []
    with Observed(path, listeners=[lambda *each: seen.append(each)]) as observed:
        observed.poll()
        last = {port: value for _, port, value in seen}
        assert last == observed.values
    ats = [at for at, _, _ in seen]
    assert ats == sorted(ats)
    assert (SECOND, COMMAND) in {(at, port) for at, port, _ in seen}


@pytest.mark.slow
def test_a_recording_is_served_to_no_viewer(tmp_path: Path, command: Command) -> None:
    path = record(tmp_path / "x.recording", "tachobot", 0.1)
    assert "this is a recording" in command.refused("view", path, "--foxglove")


class Odd(NamedTuple):
    """All kinds of fields."""

    name: str
    flags: tuple[bool, ...]
    pair: tuple[int, int]
    applied: Applied
    maybe: float | None
    either: int | str
    anything: object


def test_a_schema_is_what_a_value_becomes() -> None:
    assert schema_of(Odd) == {
        "title": "Odd",
        "type": "object",
        "properties": {
            "name": {"type": "string"},
            "flags": {"type": "array", "items": {"type": "boolean"}},
            "pair": {"type": "array", "items": {"type": "integer"}},
            "applied": {"type": "string"},
            "maybe": {"type": "number"},
            "either": {},
            "anything": {},
        },
    }
    assert schema_of(bool)["properties"] == {"value": {"type": "boolean"}}


def test_a_pair_of_different_things_has_no_one_type() -> None:
    assert schema_of(tuple[int, str])["properties"] == {"value": {"type": "array", "items": {}}}


def test_a_port_that_is_taken_is_one_sentence(ports: Mapping[str, Port]) -> None:
    with socket.create_server((LOOPBACK, 0)) as taken:
        number = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=f"{number} cannot be served"):
            FoxgloveChannels("tachobot", ports, port=number)


def test_without_the_extra_the_command_is_named(
    ports: Mapping[str, Port], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(ConfigError, match="foxglove"):
        FoxgloveChannels("tachobot", ports, port=0)
