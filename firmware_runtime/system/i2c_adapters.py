"""The I2C adapters of a machine, as /dev and /sys show them: names, drivers of addresses."""

import re
from typing import Final, NamedTuple

from firmware_runtime.system.files import SystemFiles

NODES: Final = "/dev/i2c-*"
_MAINBOARD: Final = ("the SMBus of the mainboard", re.compile(r"smbus|piix4|i801", re.IGNORECASE))
_DISPLAY: Final = (
    "a display's (DDC)",
    re.compile(
        r"ddc|gmbus|dpaux|aux |hdmi|amdgpu|radeon|nvidia|nouveau"
        r"|fef0[0-9]500\.i2c|107d5082[08]0\.i2c",
        re.IGNORECASE,
    ),
)
"""Adapters by a part of their names; the last two are the HDMI buses of a Raspberry Pi 4 and 5."""


class Bound(NamedTuple):
    """An address that a driver of the kernel's holds."""

    node: str
    address: int
    driver: str


def number(files: SystemFiles, node: str) -> str | None:
    """The N of a node /dev/i2c-N, also behind a link of another name."""
    found = re.search(r"i2c-(\d+)$", str(files.path(node).resolve()))
    return found[1] if found else None


def attribute(files: SystemFiles, node: str, name: str) -> str:
    """Where an attribute of a node's adapter stands."""
    return f"/sys/bus/i2c/devices/i2c-{number(files, node)}/{name}"


def name(files: SystemFiles, node: str) -> str | None:
    """What the adapter is called; None where it is not shown."""
    return files.text(attribute(files, node, "name"))


def not_for_robots(files: SystemFiles, node: str) -> str | None:
    """Whose bus it is where it serves the computer itself: a display's, the mainboard's; or None.

    Names show it, as does the kernel: it hangs a graphics card's own buses below the card (/drm/),
    and links the bus of a display to its connector.
    """
    adapter = files.path(attribute(files, node, "name")).resolve().parent
    connected = (files.path(link).resolve() for link in files.matching("/sys/class/drm/*/ddc"))
    if "/drm/" in str(adapter) or adapter in connected:
        return _DISPLAY[0]
    called = name(files, node) or ""
    kinds = (_MAINBOARD, _DISPLAY)
    return next((whose for whose, pattern in kinds if pattern.search(called)), None)


def bound(files: SystemFiles, node: str) -> list[Bound]:
    """Every address of a bus that a driver of the kernel's holds."""
    found = []
    for path in files.matching(f"/sys/bus/i2c/devices/{number(files, node)}-*/driver"):
        address = path.split("/")[-2].partition("-")[2]
        found.append(Bound(node, int(address, 16), files.path(path).resolve().name))
    return found
