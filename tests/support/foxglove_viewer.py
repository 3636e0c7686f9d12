"""A viewer that speaks Foxglove's protocol. Source: github.com/foxglove/ws-protocol."""

import asyncio
import json
import struct
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType

from tests.support.waiting import PATIENCE_S

_MESSAGE = struct.Struct("<BIQ")
"""Opcode, subscription and time of a message."""
_OWN = 7
T = TypeVar("T")


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

    async def subscribe(self, topic: str) -> dict[str, Any]:
        """Look at a topic; return its channel."""
        channels: dict[str, Any] = {}
        while topic not in channels:
            advertised = await self.said("advertise")
            channels |= {each["topic"]: each for each in advertised["channels"]}
        asked = [{"id": _OWN, "channelId": channels[topic]["id"]}]
        await self._socket.send_json({"op": "subscribe", "subscriptions": asked})
        return dict(channels[topic])

    async def value(self) -> tuple[int, Any]:
        """Date and value of the next message."""
        while True:
            message = await self._socket.receive()
            assert message.type in {WSMsgType.TEXT, WSMsgType.BINARY}
            if message.type is WSMsgType.BINARY:
                op, subscription, at = _MESSAGE.unpack_from(message.data)
                assert (op, subscription) == (1, _OWN)
                return at, json.loads(message.data[_MESSAGE.size :])


@asynccontextmanager
async def viewer_of(address: str) -> AsyncIterator[Viewer]:
    """Connect to a server."""
    async with (
        ClientSession() as session,
        session.ws_connect(address, protocols=("foxglove.sdk.v1",)) as socket,
    ):
        yield Viewer(socket)


def viewed(coroutine: Coroutine[Any, Any, T]) -> T:
    """What it returns, within a bound."""
    return asyncio.run(asyncio.wait_for(coroutine, PATIENCE_S))
