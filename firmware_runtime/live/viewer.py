"""One viewer: the socket of a page that is open, and what it has been sent so far.

A viewer that is slow gets fewer frames, each with all that has come meanwhile in so many points at
most: nothing waits for it, and no peak is lost.
"""

import asyncio
from contextlib import suppress
from typing import Any, Final

import msgspec
from aiohttp import WSMsgType, web

from firmware_runtime.live.observed import Observed
from firmware_runtime.live.run_state import RunState
from firmware_runtime.live.trace import Points
from firmware_runtime.statistics.json_values import NOT_JSON

MOST_POINTS: Final = 400
"""Points of one curve in one frame."""
MOST_LEAVES: Final = 64
BACK_S: Final = 60.0
"""How much of the past a curve begins with, s."""
BACK_POINTS: Final = 2_000
LONGEST: Final = 4_096
"""Bytes of a message of a viewer."""
_PATIENCE_S: Final = 10.0

_encode: Final = msgspec.json.Encoder().encode


class _Asked(msgspec.Struct, forbid_unknown_fields=True):
    """What a page says: the leaves that it plots from now on."""

    watch: list[str]


class Viewer:
    """Sends frames of a run to one socket."""

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self._socket = socket
        self._sending: asyncio.Task[None] | None = None
        self._sent_until: dict[str, float] = {}
        """By leaf, the instant up to which its curve has been sent, s."""
        self._states_until = float("-inf")
        self._state: RunState | None = None
        self._run = ""
        self._at = -1
        """The instant of the run in the frame before, ns."""
        self._leaves = 0
        """How many leaves there were when it was sent their names."""

    async def listen(self) -> None:
        """Take what the page says until it is gone."""
        async for message in self._socket:
            if message.type is not WSMsgType.TEXT or not self._hear(message.data):
                await self._socket.close(code=1008, message=b"expected a list of leaves")
                return

    def offer(self, observed: Observed, state: RunState | None) -> None:
        """Send a frame, unless the one before is still on its way."""
        if self._sending is not None and not self._sending.done():
            return
        frame = self._frame(observed, state)
        if frame:
            self._sending = asyncio.create_task(self._send(_encode(frame)))

    async def close(self) -> None:
        """Close the socket."""
        if self._sending is not None:
            self._sending.cancel()
        await self._socket.close(code=1001)

    async def _send(self, content: bytes) -> None:
        try:
            async with asyncio.timeout(_PATIENCE_S):
                await self._socket.send_str(content.decode())
        except (ConnectionError, TimeoutError, RuntimeError):
            with suppress(ConnectionError, RuntimeError):
                await self._socket.close()

    def _hear(self, text: str) -> bool:
        try:
            asked = msgspec.json.decode(text, type=_Asked)
        except NOT_JSON:
            return False
        leaves = asked.watch[:MOST_LEAVES]
        self._sent_until = {leaf: self._sent_until.get(leaf, -1.0) for leaf in leaves}
        return True

    def _frame(self, observed: Observed, state: RunState | None) -> dict[str, Any]:
        """What has come since the frame before; empty where nothing has."""
        is_another = observed.header.run != self._run
        if is_another:  # nothing of it has been sent
            self._sent_until = dict.fromkeys(self._sent_until, -1.0)
            self._states_until = float("-inf")
        frame: dict[str, Any] = {}
        points = ((leaf, self._points(observed, leaf)) for leaf in self._sent_until)
        if some := {leaf: new for leaf, new in points if new is not None}:
            frame["points"] = some
        stays = {
            name: new
            for name, each in observed.words.items()
            if (new := each.since(self._states_until))
        }
        if stays:
            frame["stays"] = stays
            self._states_until = max(entries[-1][0] for entries in stays.values())
        if state is not None and state != self._state:
            frame["state"] = self._state = state
        if len(observed.numbers) != self._leaves:
            frame["leaves"] = sorted(observed.numbers)
            self._leaves = len(frame["leaves"])
        if is_another:
            frame["run"] = self._run = observed.header.run
        if not frame and observed.at == self._at:
            return frame
        self._at = observed.at
        now = {"at": observed.at / 1e9, "values": observed.values, "states": observed.states}
        return now | frame

    def _points(self, observed: Observed, leaf: str) -> Points | None:
        trace = observed.numbers.get(leaf)
        if trace is None:
            return None
        sent_until, back = self._sent_until[leaf], observed.at / 1e9 - BACK_S
        most = BACK_POINTS if sent_until < back else MOST_POINTS
        points = trace.since(max(sent_until, back), most)
        if not points.times:
            return None
        self._sent_until[leaf] = points.times[-1]
        return points
