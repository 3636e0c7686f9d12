"""Viewers of the page: `python -m benchmarks.reader.viewers FILE`, its commands are bytes.

`view` serves the page of the run that keeps FILE, in a process of its own. `+` makes that go on,
and so many viewers of so many curves each watch it; `-` sends them away and stops it, and prints
how many frames they got. It ends with its input.
"""

import asyncio
import json
import os
import signal
import sys
from typing import Final
from urllib.request import urlopen

import aiohttp

from benchmarks.reader.process import READ
from benchmarks.shared.page import served

VIEWERS: Final = 8
CURVES: Final = 20
_INPUT: Final = 0


def main() -> None:
    """Obey until there is nothing more to obey."""
    with served("view", "--statistics", sys.argv[1]) as view:
        address, server = view
        leaves = leaves_of(address)
        server.send_signal(signal.SIGSTOP)
        try:
            while os.read(_INPUT, 1) == READ:
                server.send_signal(signal.SIGCONT)
                print(asyncio.run(_watch(address, leaves)), flush=True)
                server.send_signal(signal.SIGSTOP)
        finally:
            server.send_signal(signal.SIGCONT)


def leaves_of(address: str) -> list[str]:
    """So many of the curves that a page offers."""
    with urlopen(f"{address}/api/model") as answer:  # noqa: S310 -- of this machine
        leaves: list[str] = json.load(answer)["leaves"]
    return leaves[:CURVES]


async def _watch(address: str, leaves: list[str]) -> int:
    """Watch until the next command; return how many frames came."""
    loop = asyncio.get_running_loop()
    async with aiohttp.ClientSession() as session:
        viewers = [asyncio.create_task(watch(session, address, leaves)) for _ in range(VIEWERS)]
        await loop.run_in_executor(None, os.read, _INPUT, 1)
        for each in viewers:
            each.cancel()
        frames = await asyncio.gather(*viewers)
    return sum(frames)


async def watch(session: aiohttp.ClientSession, address: str, leaves: list[str]) -> int:
    """Watch until it is cancelled; return how many frames came."""
    frames = 0
    try:
        async with session.ws_connect(f"{address}/ws", origin=address) as socket:
            await socket.send_str(json.dumps({"watch": leaves}))
            async for _ in socket:
                frames += 1
    except asyncio.CancelledError:
        pass
    return frames


if __name__ == "__main__":
    main()
