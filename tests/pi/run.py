"""`make pi-test`: boots an emulated Raspberry Pi 3B and shows how its checks went.

`python -m tests.pi.run rt` boots Debian's PREEMPT_RT kernel, and `... --armed-minutes 30` keeps
TachoBot armed for so long instead. Exit status as of `make vm-test`.
"""

import gzip
import shutil
import subprocess
import sys
import zlib
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from firmware_runtime.board.settings import BusSettings
from firmware_runtime.cli.arguments import positive
from tests.pi.computer import command
from tests.pi.guest import endurance
from tests.pi.guest.emulated import ASKED
from tests.pi.guest.main import SHORT
from tests.pi.image import KERNELS, Image, built, pack, why_impossible
from tests.pi.player import Player
from tests.vm.commands import Unbuildable, end_in_order, lacking, show
from tests.vm.machine import started
from tests.vm.run import stage
from tests.vm.tally import END, Tally
from tests.vm.wheels import SOURCE_ONLY, make_wheel, pip

HOME: Final = Path(__file__).parents[2] / "build" / "pi"
LIMIT_S: Final = 900.0
"""Longer than all checks take on a busy machine."""
PATIENT_MS: Final = 1000
"""The adapter's timeout of the checks."""
NEEDED: Final = {"cpio": "cpio", "xz": "xz-utils", "dpkg-deb": "dpkg", "gzip": "gzip"}


def main() -> int:
    """Run all stages; each says how long it took."""
    end_in_order()
    asked = _arguments()
    if why := why_impossible():
        show(f"pi-test: skipped: {why}")
        return 0
    if missing := lacking(NEEDED, "pi-test"):
        show(f"pi-test: {missing}")
        return 2
    try:
        with stage("image"):
            image = built(HOME, asked.kernels)
        with stage("wheel and checks"):
            wheels = wheels_in(HOME / "wheels")
        return max(_checks(image, kind, wheels, asked) for kind in asked.kernels)
    except Unbuildable as error:
        show(f"pi-test: {error}")
        return 1


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="pi-test", description=__doc__)
    parser.add_argument("kernels", nargs="*", metavar="KERNEL", help=f"{' or '.join(KERNELS)}")
    parser.add_argument(
        "--armed-minutes",
        type=positive,
        metavar="MINUTES",
        help="instead: TachoBot armed at 20 Hz for so long, with other load beside it",
    )
    parser.add_argument(
        "--timeout-ms",
        type=int,
        metavar="MS",
        help="with it: the adapter's timeout; default: a board's",
    )
    asked = parser.parse_args()
    asked.kernels = asked.kernels or ["stock"]
    if unknown := [kind for kind in asked.kernels if kind not in KERNELS]:
        parser.error(f"{', '.join(unknown)}: no kernel; expected {' or '.join(KERNELS)}")
    if asked.armed_minutes is None and asked.timeout_ms is not None:
        parser.error("--timeout-ms without --armed-minutes; expected both")
    if asked.timeout_ms is not None and not 10 <= asked.timeout_ms <= 2000:
        parser.error(f"--timeout-ms {asked.timeout_ms}; expected 10 to 2000")
    if asked.armed_minutes is None:
        asked.timeout_ms = PATIENT_MS
    elif asked.timeout_ms is None:
        asked.timeout_ms = BusSettings(device="/dev/i2c-1", speed_hz=1).timeout_ms
    return asked


def wheels_in(folder: Path) -> Path:
    """Make the project's wheel there, and those of what is published as source only."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    pip("wheel", "--no-deps", "--wheel-dir", folder, *SOURCE_ONLY)
    make_wheel(folder)
    return folder


def _checks(image: Image, kind: str, wheels: Path, asked: Namespace) -> int:
    with stage("initrd"):
        pack(image, kind, wheels)
    logs = HOME / "logs" / kind
    logs.mkdir(parents=True, exist_ok=True)
    tally = Tally()
    words, limit_s = _chosen(asked)
    expected = len(SHORT) + 3 if asked.armed_minutes is None else len(endurance.CHECKS) + 1
    with (
        Player(logs, asked.timeout_ms) as player,
        stage(f"checks, {kind} kernel"),
        started(
            command(image, kind, logs, words, player.uart_path), logs, limit_s, player.console
        ) as lines,
    ):
        for each in lines:
            line = each.replace("\r", "")
            if line.startswith(ASKED):
                player.ask(line.removeprefix(ASKED))
            else:
                tally.take(line)
            if line == END:
                break
    tally.take(player.watch.line())
    if asked.armed_minutes is None:
        tally.take(player.uart.line())
        tally.take(_replayed(player.carried, logs / "tachobot.recording"))
    if (said := tally.passed + tally.failed) != expected:
        tally.take(f"FAILED {expected} checks say how they went: {said} did")
    if not tally.has_passed:
        tally.show_logs(logs)
    show(tally.closing_line())
    return 0 if tally.has_passed else 1


def _chosen(asked: Namespace) -> tuple[str, float]:
    """Return the words to the kernel, which gives the first process those it does not know."""
    words = f"BUS_TIMEOUT_MS={asked.timeout_ms}"
    if asked.armed_minutes is None:
        return f"loglevel=1 {words}", LIMIT_S
    minutes = asked.armed_minutes
    return f"loglevel=4 {words} ARMED_MINUTES={minutes:g}", LIMIT_S + 3 * 60 * minutes


def _replayed(carried: Mapping[int, bytes], file: Path) -> str:
    """Replay here what was recorded there; how that went, as a line of the guest."""
    what = "its recording replays identically on this computer"
    try:
        file.write_bytes(gzip.decompress(b"".join(carried[each] for each in sorted(carried))))
    except (ValueError, OSError, EOFError, zlib.error) as error:
        return f"FAILED {what}: it did not come back whole: {error}"
    words = [sys.executable, "-m", "firmware_runtime.cli", "replay", str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    said = " | ".join((done.stdout + done.stderr).splitlines())
    return f"{'ok' if done.returncode == 0 else 'FAILED'} {what} ({said})"


if __name__ == "__main__":
    sys.exit(main())
