"""The page's server: the page, its data as JSON, and a socket for each viewer.

One loop polls the run some twenty times a second, for all viewers, and offers what it read to
each of them. Whatever may take long (a question to the run, a replay) is in a thread of its own.
"""

import asyncio
import signal
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any, Final, TypeAlias

import msgspec
from aiohttp import web

from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.live.actions import Actions, number_in
from firmware_runtime.live.entrance import COOKIE, Entrance
from firmware_runtime.live.source import Source
from firmware_runtime.live.viewer import LONGEST, Viewer
from firmware_runtime.statistics.json_values import NOT_JSON
from firmware_runtime.view.page import html_of

EVERY_S: Final = 0.05
"""From one look at the recording to the next."""
STATE_EVERY: Final = 10
"""Looks at the recording to one at the statistics."""
MOST_VIEWERS: Final = 64
LARGEST_REQUEST: Final = 64 * 1024
_SCRIPTS: Final = ("live_plots.js", "rewind.js", "tuning.js", "breaking.js", "live.js")
Handler: TypeAlias = Callable[[web.Request], Awaitable[web.StreamResponse]]

_encode: Final = msgspec.json.Encoder(enc_hook=str).encode


class PageServer:
    """Serves the page of one run."""

    def __init__(self, source: Source, entrance: Entrance, actions: Actions) -> None:
        self._source, self._entrance, self._actions = source, entrance, actions
        self._viewers: set[Viewer] = set()
        self._observing = ThreadPoolExecutor(1, "observing")
        self._asking = ThreadPoolExecutor(4, "asking")
        self._page: bytes | None = None
        self._has_seen = asyncio.Event()
        """Set once the run has been looked at."""
        self.application = web.Application(
            middlewares=[self._judge], client_max_size=LARGEST_REQUEST
        )
        self.application.add_routes(
            [
                web.get("/", self._get_page),
                web.get("/ws", self._get_socket),
                web.get("/api/state", self._get_state),
                web.get("/api/model", self._get_model),
                web.get("/api/range", self._get_range),
                web.get("/api/{name}", self._get),
                web.post("/api/{name}", self._post),
            ]
        )

    # The run --------------------------------------------------------------------------------------

    async def observe(self) -> None:
        """Look at the run for as long as the server is there."""
        loop = asyncio.get_running_loop()
        number = 0
        while True:
            began = loop.time()
            if number % STATE_EVERY == 0:
                await loop.run_in_executor(self._asking, self._look)
            with suppress(FirmwareRuntimeError, OSError):
                await loop.run_in_executor(self._observing, self._source.observe)
            self._has_seen.set()
            for viewer in self._viewers:
                viewer.offer(self._source.observed, self._source.state)
            number += 1
            await asyncio.sleep(max(EVERY_S - (loop.time() - began), EVERY_S / 5))

    def _look(self) -> None:
        with suppress(FirmwareRuntimeError, OSError):
            self._source.reopen()
            self._source.look()

    # Requests -------------------------------------------------------------------------------------

    @web.middleware
    async def _judge(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if self._entrance.is_token(request.query.get("token", "")):
            answer = web.HTTPFound("/")
            answer.set_cookie(COOKIE, self._entrance.token or "", httponly=True, samesite="Strict")
            return answer
        why_not = self._entrance.why_not(request.method, request.headers, request.cookies)
        if why_not is not None:
            return web.Response(status=403, text=f"refused: {why_not}\n")
        try:
            response = await handler(request)
        except FirmwareRuntimeError as error:
            faults = list(error.faults) if isinstance(error, ConfigError) else [text_of(error)]
            return _json({"refused": faults}, status=409)
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Cross-Origin-Resource-Policy"] = "same-origin"
        response.headers["X-Frame-Options"] = "DENY"
        response.headers["Cache-Control"] = "no-store"
        return response

    async def _get_page(self, _request: web.Request) -> web.Response:
        if self._page is None:
            title = f"{self._source.board.name}: live"
            data = {"can": self._actions.can}
            self._page = html_of(title, data, _SCRIPTS, connects_to="'self'").encode()
        return web.Response(body=self._page, content_type="text/html", charset="utf-8")

    async def _get_socket(self, request: web.Request) -> web.StreamResponse:
        if len(self._viewers) >= MOST_VIEWERS:
            return web.Response(status=503, text=f"refused: {MOST_VIEWERS} watch already\n")
        socket = web.WebSocketResponse(max_msg_size=LONGEST, heartbeat=20.0, compress=False)
        await socket.prepare(request)
        viewer = Viewer(socket)
        self._viewers.add(viewer)
        try:
            await viewer.listen()
        finally:
            self._viewers.discard(viewer)
        return socket

    async def _get_state(self, _request: web.Request) -> web.Response:
        await self._has_seen.wait()
        if self._source.state is None or not self._source.is_live:
            await self._in_thread(self._source.look)
        return _json(self._source.state or {})

    async def _get_model(self, _request: web.Request) -> web.Response:
        await self._has_seen.wait()
        return _json(await self._in_thread(self._source.model))

    async def _get_range(self, request: web.Request) -> web.Response:
        """Curves of a stretch: `from` and `until` in s, `leaf` as often as there are curves."""
        await self._has_seen.wait()
        observed = self._source.observed
        begin, end = (number_in(request.query, name) for name in ("from", "until"))
        most = int(min(max(number_in({"most": 2000, **request.query}, "most"), 10.0), 20_000.0))
        leaves = request.query.getall("leaf", [])[:64]
        found = {
            leaf: observed.numbers[leaf].between(begin, end, most)
            for leaf in leaves
            if leaf in observed.numbers
        }
        words = {name: each.between(begin, end) for name, each in observed.words.items()}
        return _json({"points": found, "stays": words})

    async def _get(self, request: web.Request) -> web.Response:
        return await self._act(request.match_info["name"], dict(request.query), is_change=False)

    async def _post(self, request: web.Request) -> web.Response:
        try:
            said = msgspec.json.decode(await request.read() or b"{}", type=dict[str, Any])
        except NOT_JSON:
            return _json({"refused": ["expected an object in JSON"]}, status=400)
        return await self._act(request.match_info["name"], said, is_change=True)

    async def _act(self, name: str, said: Mapping[str, Any], *, is_change: bool) -> web.Response:
        act = self._actions.of(name, is_change=is_change)
        if act is None:
            return _json({"refused": [f"{name}: nothing of that name"]}, status=404)
        found = await self._in_thread(lambda: act(said))
        if isinstance(found, bytes):
            return web.Response(body=found, content_type="application/octet-stream")
        return _json(found)

    async def _in_thread(self, do: Callable[[], Any]) -> Any:  # noqa: ANN401 -- whatever it returns
        return await asyncio.get_running_loop().run_in_executor(self._asking, do)

    async def close(self) -> None:
        """Send the viewers away."""
        await asyncio.gather(*(each.close() for each in list(self._viewers)))
        self._observing.shutdown(wait=False, cancel_futures=True)
        self._asking.shutdown(wait=False, cancel_futures=True)


def _json(content: object, status: int = 200) -> web.Response:
    return web.Response(body=_encode(content), content_type="application/json", status=status)


async def serve_until_signal(
    server: PageServer,
    entrance: Entrance,
    *,
    socket: str | None,
    ready: Callable[[int], None],
) -> None:
    """Serve until SIGINT or SIGTERM; `ready` is called with the port. Raises OSError."""
    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    for each in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(each, stopped.set)
    runner = web.AppRunner(server.application, access_log=None, handle_signals=False)
    await runner.setup()
    observing = asyncio.create_task(server.observe())
    try:
        site: web.BaseSite
        if socket is None:
            site = web.TCPSite(runner, entrance.address, entrance.port)
        else:
            site = web.UnixSite(runner, socket)
        await site.start()
        if socket is None:
            entrance.port = runner.addresses[0][1]
        ready(entrance.port)
        await stopped.wait()
    finally:
        observing.cancel()
        await server.close()
        await runner.cleanup()
