"""Values of ports over Foxglove's protocol, as a viewer gets them."""

import asyncio
import json
import socket
import struct
import sys
from collections.abc import Coroutine, Mapping
from typing import Any, NamedTuple, TypeVar

import pytest
from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType

from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError
from firmware_runtime.live.foxglove import LOOPBACK, FoxgloveChannels, schema_of, topic_of
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.recording.exports.typed_values import Port, ports_of
from tests.support.waiting import PATIENCE_S

COMMAND, YAW = "controller.yaw.command_n", "controller.attitude.yaw"
BEGAN = 1_700_000_000_000_000_000
_MESSAGE = struct.Struct("<BIQ")
"""Opcode, subscription and time of a message. Source: ws-protocol, Message Data."""
T = TypeVar("T")


@pytest.fixture(scope="module")
def ports() -> Mapping[str, Port]:
    return ports_of(registry.load("tachobot").unconnected().model)


class Viewer:
    """A viewer of a server, which says first what it is and which channels it has."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self._socket = socket

    async def said(self, op: str) -> dict[str, Any]:
        """What the server says next of a kind, in JSON."""
        while True:
            message = await self._socket.receive()
            assert message.type in {WSMsgType.TEXT, WSMsgType.BINARY}
            if message.type is WSMsgType.TEXT and json.loads(message.data)["op"] == op:
                return dict(json.loads(message.data))

    async def subscribe(self, channel: int) -> None:
        asked = {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel}]}
        await self._socket.send_json(asked)

    async def value(self) -> tuple[int, Any]:
        """Date and value of the next message."""
        while True:
            message = await self._socket.receive()
            assert message.type in {WSMsgType.TEXT, WSMsgType.BINARY}
            if message.type is WSMsgType.BINARY:
                op, subscription, at = _MESSAGE.unpack_from(message.data)
                assert (op, subscription) == (1, 7)
                return at, json.loads(message.data[_MESSAGE.size :])


def viewed(coroutine: Coroutine[Any, Any, T]) -> T:
    return asyncio.run(asyncio.wait_for(coroutine, PATIENCE_S))


async def first_value(
    served: FoxgloveChannels, path: str, value: object, topic: str
) -> tuple[dict[str, Any], dict[str, Any], tuple[int, Any]]:
    """What the server says of itself, of a topic, and what a viewer of it gets of a value."""
    url = f"ws://{LOOPBACK}:{served.port}"
    async with (
        ClientSession() as session,
        session.ws_connect(url, protocols=("foxglove.sdk.v1",)) as socket,
    ):
        viewer = Viewer(socket)
        info = await viewer.said("serverInfo")
        channels: dict[str, Any] = {}
        while topic not in channels:
            advertised = await viewer.said("advertise")
            channels |= {each["topic"]: each for each in advertised["channels"]}
        await viewer.subscribe(channels[topic]["id"])
        got = asyncio.ensure_future(viewer.value())
        at = 0
        while not got.done():  # until it has subscribed
            served.send(path, at := at + 1, value)
            await asyncio.wait([got], timeout=0.01)
        return info, channels[topic], got.result()


@pytest.mark.slow
def test_a_viewer_gets_channels_schemas_and_values(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, began_ns=BEGAN, port=0) as served:
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


def test_what_nobody_looks_at_and_what_is_unknown_costs_nothing(ports: Mapping[str, Port]) -> None:
    with FoxgloveChannels("tachobot", ports, port=0) as served:
        served.send(COMMAND, 1, 0.25)
        served.send("no.such.port", 1, 0.25)
        served.close()  # again does nothing


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
