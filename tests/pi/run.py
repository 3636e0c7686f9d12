"""`make pi-test`: boots an emulated Raspberry Pi 3B and shows how its checks went.

`python -m tests.pi.run rt` boots Debian's PREEMPT_RT kernel. Exit status as of `make vm-test`.
"""

import gzip
import platform
import shutil
import subprocess
import sys
from base64 import b64decode
from pathlib import Path
from typing import Final

from tests.pi.guest.robot import CARRIED
from tests.pi.image import KERNELS, Image, built, pack
from tests.vm.commands import Unbuildable, end_in_order, show
from tests.vm.machine import started
from tests.vm.run import stage
from tests.vm.tally import END, Tally
from tests.vm.wheels import SOURCE_ONLY, make_wheel, pip

HOME: Final = Path(__file__).parents[2] / "build" / "pi"
LIMIT_S: Final = 900.0
MEMORIES: Final = (0x40, 0x68)
"""Addresses at which there is register RAM on the bus."""
NEEDED: Final = {"cpio": "cpio", "xz": "xz-utils", "dpkg-deb": "dpkg", "gzip": "gzip"}


def main() -> int:
    """Run all stages; each says how long it took."""
    end_in_order()
    kinds = sys.argv[1:] or ["stock"]
    if unknown := [kind for kind in kinds if kind not in KERNELS]:
        show(f"pi-test: {', '.join(unknown)}: no kernel; expected {' or '.join(KERNELS)}")
        return 2
    if platform.machine() != "x86_64" or not Path("/etc/debian_version").exists():
        show("pi-test: skipped: QEMU is unpacked from Debian's packages for x86_64")
        return 0
    if missing := [NEEDED[name] for name in NEEDED if shutil.which(name) is None]:
        show(f"pi-test: needs Debian packages: apt install {' '.join(missing)}")
        return 2
    try:
        with stage("image"):
            image = built(HOME, kinds)
        with stage("wheel and checks"):
            wheels = _wheels()
        return max(_checks(image, kind, wheels) for kind in kinds)
    except Unbuildable as error:
        show(f"pi-test: {error}")
        return 1


def _wheels() -> Path:
    """Make the project's wheel, and those of what is published as source only."""
    folder = HOME / "wheels"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    pip("wheel", "--no-deps", "--wheel-dir", folder, *SOURCE_ONLY)
    make_wheel(folder)
    return folder


def _checks(image: Image, kind: str, wheels: Path) -> int:
    with stage("initrd"):
        pack(image, kind, wheels)
    logs = HOME / "logs" / kind
    logs.mkdir(parents=True, exist_ok=True)
    tally, carried = Tally(), list[str]()
    with stage(f"checks, {kind} kernel"), started(_command(image, kind), logs, LIMIT_S) as lines:
        for each in lines:
            line = each.replace("\r", "")
            if line.startswith(CARRIED):
                carried.append(line.removeprefix(CARRIED))
            else:
                tally.take(line)
            if line == END:
                break
    tally.take(_replayed(carried, logs / "tachobot.recording"))
    if not tally.has_passed:
        tally.show_logs(logs)
    show(tally.closing_line())
    return 0 if tally.has_passed else 1


def _replayed(carried: list[str], file: Path) -> str:
    """Replay here what was recorded there; how that went, as a line of the guest."""
    what = "its recording replays identically on this computer"
    try:
        file.write_bytes(gzip.decompress(b64decode("".join(carried), validate=True)))
    except (ValueError, OSError, EOFError) as error:
        return f"FAILED {what}: it did not come back whole: {error}"
    words = [sys.executable, "-m", "firmware_runtime.cli", "replay", str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    said = " | ".join((done.stdout + done.stderr).splitlines())
    return f"{'ok' if done.returncode == 0 else 'FAILED'} {what} ({said})"


def _command(image: Image, kind: str) -> list[str]:
    """What starts the computer; its checks write to its console."""
    memories = [
        f"at24c-eeprom,bus=i2c-bus.1,address=0x{address:02x},rom-size=256,address-size=1"
        for address in MEMORIES
    ]
    return [
        *(*image.qemu, "-M", "raspi3b", "-smp", "4", "-m", "1G", "-accel", "tcg,thread=multi"),
        *("-kernel", str(image.kernel(kind)), "-dtb", str(image.device_tree(kind))),
        *("-initrd", str(image.initrd(kind)), "-no-reboot", "-display", "none"),
        *("-append", "console=ttyS1,115200 quiet loglevel=1 rdinit=/init panic=-1"),
        *("-serial", "null", "-serial", "stdio"),
        *(word for memory in memories for word in ("-device", memory)),
    ]


if __name__ == "__main__":
    sys.exit(main())
