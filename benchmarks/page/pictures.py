"""The pictures of README and docs, from runs on this machine: `python -m benchmarks.page.pictures`.

Those that are kept go into docs/pictures; every page, in both themes and at phone width, to be
looked at, into build/pictures. Needs the Debian packages chromium and webp.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.shared.chromium import Page, open_page
from benchmarks.shared.page import served
from benchmarks.shared.process import COMMAND
from benchmarks.shared.side_by_side import PROJECT

KEPT: Final = PROJECT / "docs" / "pictures"
LOOKED_AT: Final = PROJECT / "build" / "pictures"
_READY: Final = "document.body.dataset.ready"
_HAS_VALUES: Final = "[...document.querySelectorAll('td')].some(td => td.textContent === 'changed')"
_ALL_OF_IT: Final = 4800
"""Height of a window that shows all of a page: its plots are drawn where they are seen."""
_FRAME_MS: Final = 400
_VIRTUAL: Final = ("--doubles", "--clock", "virtual")


def main() -> None:
    """Make them all."""
    KEPT.mkdir(exist_ok=True)
    LOOKED_AT.mkdir(parents=True, exist_ok=True)
    with (
        TemporaryDirectory(prefix="pictures-") as folder,
        open_page(Path(folder) / "chrome") as page,
    ):
        work = Path(folder)
        os.environ["FIRMWARE_RUNTIME_STATE_DIRECTORY"] = str(work)
        _drawings()
        _moving(page, work)
        for name, path in _pages(work):
            _all_looks(page, name, path)
        _alive(page, work)
        page.open(work / "report.html", "light", 1100, 740)
        page.wait_for(_READY)
        page.picture(KEPT / "report.png")
    for each in sorted(KEPT.iterdir()):
        print(f"pictures: {each.relative_to(PROJECT)}, {each.stat().st_size // 1024} KiB")
    print(f"pictures: every page in {LOOKED_AT.relative_to(PROJECT)}")


def _run(*words: object) -> None:
    subprocess.run([*COMMAND, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def _drawings() -> None:
    """What needs no browser."""
    _run("show", "tachobot", "-o", KEPT / "tachobot.svg")
    _run("run", "detective", *_VIRTUAL, "--plot", KEPT / "arena.svg")


def _pages(work: Path) -> Iterator[tuple[str, Path]]:
    """Make each kind of page."""
    recording = work / "run.recording"
    _run("run", "tachobot", "--doubles", "--for", 10, "--record", recording)
    _run("report", "tachobot", "-o", work / "report.html")
    yield "report", work / "report.html"
    _run("replay", recording, "--set", "controller.yaw.kp=0.9", "-o", work / "what-if.html")
    yield "what-if", work / "what-if.html"
    _run("run", "detective", *_VIRTUAL, "--plot", work / "arena.html")
    yield "arena", work / "arena.html"
    _run("experiment", "yaw-step", "tachobot", "--stage", "simulation", "-o", work / "experiment")
    yield "experiment", work / "experiment" / "yaw-step.html"
    _run("identify", "tachobot", "--from", recording, "-o", work / "identified.html")
    yield "identified", work / "identified.html"


def _alive(page: Page, work: Path) -> None:
    """The page of a recording, of each robot."""
    for board in ("tachobot", "detective", "pan_tilt"):
        recording = work / f"{board}.recording"
        _run("run", board, *_VIRTUAL, "--record", recording)
        with served("view", recording) as view:
            _all_looks(page, f"view-{board}", f"{view.address}/", _HAS_VALUES, _ALL_OF_IT)


def _all_looks(
    page: Page, name: str, path: Path | str, is_there: str = _READY, height: int = 900
) -> None:
    for scheme in ("light", "dark"):
        for width in (1100, 380):
            page.open(path, scheme, width, height)
            page.wait_for(is_there)
            page.picture(LOOKED_AT / f"{name}-{scheme}-{width}.png", is_whole=True)
            print(f"pictures: {name}, {scheme}, {width}", file=sys.stderr)


# The moving one -----------------------------------------------------------------------------------


def _moving(page: Page, work: Path) -> None:
    """TachoBot turns, its IMU freezes, it is switched off, one rewinds: as an animated WebP."""
    frames = work / "frames"
    frames.mkdir()
    number = 0

    def film(count: int) -> None:
        nonlocal number
        for _ in range(count):
            page.evaluate(f"new Promise((done) => setTimeout(done, {_FRAME_MS}))")
            page.picture(frames / f"{number:03}.png")
            number += 1

    with served("play", "tachobot") as play:
        page.open(f"{play.address}/", "light", 1200, 760)
        page.wait_for(_READY)
        page.wait_for("state.armed")
        film(8)
        choose = "document.querySelector('select[aria-label=device]')"
        page.evaluate(f"{choose}.value = 'imu'")
        page.evaluate(f"{choose}.dispatchEvent(new Event('change'))")
        page.evaluate("document.querySelector('select[aria-label=\"for how long\"]').value = ''")
        page.click("freeze", "#break")
        film(8)
        page.evaluate("document.querySelector('#faults button')?.click()")
        film(3)
        for _ in range(6):
            page.click("step forward")
            film(1)
    words = ["img2webp", "-loop", "0", "-lossy", "-q", "55", "-m", "6", "-d", str(_FRAME_MS)]
    made = [*words, *sorted(map(str, frames.iterdir())), "-o", str(KEPT / "play.webp")]
    subprocess.run(made, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
