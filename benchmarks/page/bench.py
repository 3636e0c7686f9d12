"""The page of a run in a browser: how soon it is there, how smoothly it draws, what it withstands.

    firmware-runtime bench page [--seconds S] [--points N] [--hostile N] [--watched S]
                                [--json] [--save]

In one run of TachoBot on doubles, in real time: the time from a request to a page that shows
values; frames per second with ten plots of so many points each that go on as the run does, beside
those of an empty page in the same browser; then frames and requests that are none of a page's, of
which nothing must remain. With `--watched`, eight viewers of twenty curves each watch for so long,
and the memory of the page's process is read ten times. The ratio is frames with the plots by frames
without.
"""

import argparse
import asyncio
import os
import random
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from time import monotonic
from typing import Any, Final

import aiohttp

from benchmarks.reader.viewers import CURVES, VIEWERS, leaves_of, watch
from benchmarks.shared.chromium import Page, open_page
from benchmarks.shared.page import Served, served
from benchmarks.shared.process import tachobot
from benchmarks.shared.results import conditions, finish, positive
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.reader import read_statistics

SUMMARY = "The page of a run: how soon it is there, frames a second, hostile requests."
PLOTS: Final = 10
READY_GOAL_S, FRAMES_GOAL = 1.5, 60.0
_READY: Final = "document.body.dataset.ready"
_LENGTH_S: Final = 7_200.0
_AT_ONCE: Final = 16
_READINGS: Final = 10


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--seconds", type=positive_number, default=5.0, metavar="S", help="frames are counted for"
    )
    parser.add_argument(
        "--points", type=positive, default=100_000, metavar="N", help="of each plot"
    )
    parser.add_argument(
        "--hostile", type=positive, default=1_000, metavar="N", help="frames and requests"
    )
    parser.add_argument(
        "--watched",
        type=positive_number,
        metavar="S",
        help="memory is read for; default not at all",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio comes last."""
    before = conditions()
    with tempfile.TemporaryDirectory(prefix="page-") as folder:
        directory = Path(folder)
        with tachobot(directory, _LENGTH_S) as running:
            running.read_when(lambda statistics: statistics.cells[ELAPSED] > 2_000_000_000)
            with (
                served("view", "--statistics", running.statistics) as view,
                open_page(directory / "chromium") as page,
            ):
                report = _measured(page, view.address, arguments)
                report |= asyncio.run(_attacked(view.address, arguments.hostile))
                report["counts_exact"] = _are_exact(running.statistics)
                if arguments.watched is not None:
                    report["memory_mb"] = asyncio.run(_watched(view, arguments.watched))
    finish(arguments, "page", {"conditions": before, **report}, _lines)
    return Status.OK


def _are_exact(statistics: Path) -> bool:
    """Return whether the run has counted each of its activations once."""
    figures = read_statistics(statistics).figures()
    counted = figures.run + figures.skipped + figures.coalesced + figures.waiting
    return counted == figures.scheduled


def _measured(page: Page, address: str, arguments: argparse.Namespace) -> dict[str, Any]:
    print("bench page: in the browser", file=sys.stderr)
    page.open("about:blank", "light")
    empty = _frames(page, arguments.seconds)
    began = monotonic()
    page.open(f"{address}/", "light", 1600, 1200)
    page.wait_for(_READY)
    ready_s = monotonic() - began
    page.evaluate(_FILL.replace("PLOTS", str(PLOTS)).replace("POINTS", str(arguments.points)))
    page.wait_for(f"plots.shown.size === {PLOTS}")
    page.evaluate("plots.element.scrollIntoView()")
    before_s = page.processor_s()
    drawn = _frames(page, arguments.seconds)
    taken_s = page.processor_s() - before_s
    return {
        "ready_s": ready_s,
        "plots": PLOTS,
        "points": arguments.points,
        "frames_per_second": drawn,
        "frames_per_second_empty": empty,
        "processor_ms_per_frame": 1000 * taken_s / (drawn * arguments.seconds),
        "ratio": drawn / empty,
    }


def _frames(page: Page, seconds: float) -> float:
    """Frames a second that the browser draws."""
    found = page.evaluate(
        f"""new Promise((done) => {{
            let frames = 0;
            const began = performance.now();
            const count = (now) => {{
                frames++;
                if (typeof plots === "object" && plots) plots.draw(store.at + (now - began) / 1000);
                if (now - began < {seconds * 1000}) requestAnimationFrame(count);
                else done(frames / (now - began) * 1000);
            }};
            requestAnimationFrame(count);
        }})"""
    )
    return float(found)


_FILL: Final = """(() => {
    for (const leaf of plots.model.leaves) {
        if (plots.shown.size >= PLOTS) break;
        plots.addGroup(groupOf(leaf));
    }
    const end = store.at;
    const times = Array.from({ length: POINTS }, (_, n) => end - 300 * (1 - n / POINTS));
    for (const { leaves } of plots.shown.values()) {
        for (const leaf of leaves) store.replace(leaf, times, times.map((t) => Math.sin(7 * t)));
    }
    plots.window = 300;
})()"""


# What is none of a page's -------------------------------------------------------------------------


async def _attacked(address: str, count: int) -> dict[str, Any]:
    """Send so many requests and frames that are nonsense; return what was answered."""
    print("bench page: hostile frames and requests", file=sys.stderr)
    chance = random.Random(1)  # noqa: S311 -- nothing is secret
    answers: dict[str, int] = {}
    async with aiohttp.ClientSession() as session:
        for first in range(0, count, _AT_ONCE):
            some = range(first, min(first + _AT_ONCE, count))
            for answer in await asyncio.gather(*(_attack(session, address, chance) for _ in some)):
                answers[answer] = answers.get(answer, 0) + 1
        async with session.get(f"{address}/api/state") as state:
            alive = state.status == 200
    return {"hostile": count, "answers": answers, "lives": alive}


async def _attack(session: aiohttp.ClientSession, address: str, chance: random.Random) -> str:
    """One of them; the status, or the code with which a socket was closed."""
    junk = bytes(chance.randrange(256) for _ in range(chance.randrange(200)))
    if chance.random() < 0.5:
        async with session.ws_connect(f"{address}/ws", origin=address) as socket:
            if chance.random() < 0.5:
                await socket.send_bytes(junk)
            else:
                await socket.send_str(junk.decode("latin-1"))
            async for _ in socket:
                pass
            return f"closed {socket.close_code}"
    method = chance.choice(("GET", "POST", "PUT", "DELETE", "OPTIONS"))
    name = chance.choice(
        ("arm", "set", "disarm", "kill", "ws", "../etc", "%00", "instant", "x" * 99)
    )
    origin = chance.choice((address, "http://evil.example", "null"))
    if name in {"arm", "disarm", "kill"}:  # which its own page may do
        origin = "http://evil.example"
    headers = {"Origin": origin}
    async with session.request(
        method, f"{address}/api/{name}", data=junk, headers=headers
    ) as answer:
        await answer.read()
        return str(answer.status)


# Memory -------------------------------------------------------------------------------------------


async def _watched(view: Served, seconds: float) -> list[tuple[float, float]]:
    """Minutes, and MB that the page's process has then, while viewers watch."""
    print(f"bench page: {VIEWERS} viewers of {CURVES} curves", file=sys.stderr)
    leaves = leaves_of(view.address)
    async with aiohttp.ClientSession() as session:
        viewers = [
            asyncio.create_task(watch(session, view.address, leaves)) for _ in range(VIEWERS)
        ]
        found = []
        for number in range(1, _READINGS + 1):
            await asyncio.sleep(seconds / _READINGS)
            found.append((number * seconds / _READINGS / 60, _memory_mb(view.process.pid)))
        for each in viewers:
            each.cancel()
        await asyncio.gather(*viewers)
    return found


def _memory_mb(process: int) -> float:
    """What a process has resident, MB."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    yield f"ready after {report['ready_s']:.2f} s; goal {READY_GOAL_S} s"
    plots = f"{report['plots']} plots of {report['points']} points"
    frames, empty = report["frames_per_second"], report["frames_per_second_empty"]
    yield f"{frames:.1f} frames a second with {plots}, {empty:.1f} without; goal {FRAMES_GOAL:g}"
    yield f"{report['processor_ms_per_frame']:.1f} ms of processor time a frame, all of the browser"
    answers = ", ".join(f"{each} {count}" for each, count in sorted(report["answers"].items()))
    lives = "it lives" if report["lives"] else "IT HAS DIED"
    lives += ", the run's counts are exact" if report["counts_exact"] else ", THE RUN'S ARE NOT"
    yield f"{report['hostile']} hostile frames and requests ({answers}): {lives}"
    if "memory_mb" in report:
        figures = ", ".join(f"{mb:.0f} after {after:.1f} min" for after, mb in report["memory_mb"])
        yield f"memory of the page's process, MB: {figures}; goal level"
    yield f"ratio {report['ratio']:.2f}, frames with the plots by frames without"
