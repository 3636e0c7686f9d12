"""`make vm-test`: builds the guest, boots it, shows how its checks went.

`python -m tests.vm.run network` carries out the checks of guest/network.py alone, and
`... service ros` those of the ROS 2 node's unit, which `make vm-test` leaves out: with rclpy from
.venv-ros they take minutes more.

Exit status 0 when all checks passed, or where QEMU cannot run at all; 1 when one failed or the
guest did not get through them; 2 when something is missing that can be installed.
"""

import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Final

from tests.vm.commands import Unbuildable, end_in_order, lacking, show
from tests.vm.image import Image, build, image_in
from tests.vm.machine import accelerator, booted
from tests.vm.tally import Tally
from tests.vm.wheels import write_carried, write_ros

HOME: Final = Path(__file__).parents[2] / "build" / "vm"
LIMIT_S: Final = 2400.0
NEEDED: Final = {
    "qemu-system-x86_64": "qemu-system-x86",
    "mmdebstrap": "mmdebstrap",
    "mke2fs": "e2fsprogs",
    "/bin/busybox": "busybox-static",
    "modprobe": "kmod",
    "cpio": "cpio",
}
"""Programs, and the Debian packages they come in."""


def main() -> int:
    """Run all stages; each says how long it took."""
    end_in_order()
    if why := _impossible():
        show(f"vm-test: skipped: {why}")
        return 0
    if missing := lacking(NEEDED, "vm-test", "unpacks Debian packages"):
        show(f"vm-test: {missing}")
        return 2
    try:
        image = _image()
        with stage("wheel and checks"):
            write_carried(HOME / "carried.tar", HOME, sys.argv[1:])
            python = image.python.read_text(encoding="ascii") if "ros" in sys.argv else ""
            write_ros(HOME / "ros.tar", python)
    except Unbuildable as error:
        show(f"vm-test: {error}")
        return 1
    return _checks(image)


def _impossible() -> str | None:
    """Why there is no guest for this machine, in a sentence."""
    if platform.machine() != "x86_64":
        return f"the guest is x86_64 and this machine is {platform.machine()}"
    if not Path("/etc/debian_version").exists():
        return "the guest is made of Debian packages, and this machine has no apt for them"
    return None


def _image() -> Image:
    """The image, built if its recipe has changed."""
    image = image_in(HOME / "image")
    if image.is_there:
        show("image: as it was")
    else:
        with stage("image"):
            build(image)
    return image


def _checks(image: Image) -> int:
    """Boot the guest and take down what it says."""
    logs = HOME / "logs"
    logs.mkdir(exist_ok=True)
    accel = accelerator(image)
    show(f"guest: {_HOW[accel]}")
    tally = _boot(image, logs, accel)
    if tally.is_empty:
        show("guest: it never came up; once more")
        tally = _boot(image, logs, accel)
    if not tally.has_passed:
        tally.show_logs(logs)
    show(tally.closing_line())
    return 0 if tally.has_passed else 1


def _boot(image: Image, logs: Path, accel: str) -> Tally:
    tally = Tally()
    disks = [disk for disk in (HOME / "carried.tar", HOME / "ros.tar") if disk.exists()]
    with stage("checks"), booted(image, disks, logs, accel, LIMIT_S) as lines:
        for line in lines:
            tally.take(line)
    return tally


_HOW: Final = {
    "kvm": "QEMU with the processor's own virtualization (KVM)",
    "tcg": "QEMU, emulated (TCG): slow, behaviour counts and not time",
}


@contextmanager
def stage(name: str) -> Iterator[None]:
    show(f"{name} ...")
    began_at = monotonic()
    yield
    show(f"{name}: {monotonic() - began_at:.0f} s")


if __name__ == "__main__":
    sys.exit(main())
