"""Device nodes: which processes have one open, and the I2C adapters behind them."""

import os
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from firmware_runtime.system.kernel_files import SystemFiles


class Holder(NamedTuple):
    """A process, and the node it has open."""

    process: int
    command: str
    node: str
    is_alone: bool = False
    """It has locked the node, as a run does; what only looks on, such as a guard, has not."""


class Holders(NamedTuple):
    """Holders that were found, and the number of processes that hide their files from this user."""

    found: list[Holder]
    hidden: int


def holders(files: SystemFiles, nodes: Collection[str]) -> Holders:
    """The processes besides this one that have one of these nodes open."""
    targets = {os.path.realpath(files.path(node)): node for node in nodes}
    found: list[Holder] = []
    hidden = 0
    for name in _processes(files):
        held = _held(files, name, targets)
        hidden += held is None
        command = _command(files, name) if held else ""
        found += (Holder(int(name), command, *each) for each in sorted((held or {}).items()))
    return Holders(found, hidden)


def _processes(files: SystemFiles) -> list[str]:
    names = (path.rpartition("/")[2] for path in files.matching("/proc/[0-9]*"))
    return [name for name in names if name.isdecimal() and int(name) != os.getpid()]


def _held(files: SystemFiles, process: str, targets: Mapping[str, str]) -> dict[str, bool] | None:
    """Return which of these nodes a process has open, and whether locked.

    None if it may not be seen, nothing if it has just ended.
    """
    folder = files.path(f"/proc/{process}/fd")
    try:
        descriptors = list(folder.iterdir())
    except FileNotFoundError:
        return {}
    except OSError:
        return None
    held: dict[str, bool] = {}
    for each in descriptors:
        if (node := targets.get(_target(each) or "")) is not None:
            held[node] = held.get(node, False) or _is_locked(files, process, each.name)
    return held


def _is_locked(files: SystemFiles, process: str, descriptor: str) -> bool:
    return "FLOCK" in (files.text(f"/proc/{process}/fdinfo/{descriptor}") or "")


def _target(descriptor: Path) -> str | None:
    try:
        return str(descriptor.readlink())
    except OSError:
        return None


def _command(files: SystemFiles, process: str) -> str:
    return files.text(f"/proc/{process}/comm") or "a process without a name"


NODES: Final = "/dev/i2c-*"
_MAINBOARD: Final = ("the SMBus of the mainboard", r"(?i)smbus|piix4|i801")
_DISPLAY: Final = (
    "a display's (DDC)",
    (
        r"(?i)ddc|gmbus|dpaux|aux |hdmi|amdgpu|radeon|nvidia|nouveau"
        r"|fef0[0-9]500\.i2c|107d5082[08]0\.i2c"
    ),
)
"""Adapters by a part of their names; the last two are the HDMI buses of a Raspberry Pi 4 and 5."""


class Bound(NamedTuple):
    """An address that a driver of the kernel's holds."""

    node: str
    address: int
    driver: str


def adapter_number(files: SystemFiles, node: str) -> str | None:
    """The N of a node /dev/i2c-N, also behind a link of another name."""
    found = re.search(r"i2c-(\d+)$", str(files.path(node).resolve()))
    return found[1] if found else None


def adapter_attribute(files: SystemFiles, node: str, name: str) -> str:
    """Return where an attribute of a node's adapter stands."""
    return f"/sys/bus/i2c/devices/i2c-{adapter_number(files, node)}/{name}"


def adapter_name(files: SystemFiles, node: str) -> str | None:
    """Return what the adapter is called; None where it is not shown."""
    return files.text(adapter_attribute(files, node, "name"))


def not_for_robots(files: SystemFiles, node: str) -> str | None:
    """Return the part of the computer that a bus serves: a display, the mainboard; or None.

    Names show it, as does the kernel: it hangs a graphics card's own buses below the card (/drm/),
    and links the bus of a display to its connector.
    """
    adapter = files.path(adapter_attribute(files, node, "name")).resolve().parent
    connected = (files.path(link).resolve() for link in files.matching("/sys/class/drm/*/ddc"))
    if "/drm/" in str(adapter) or adapter in connected:
        return _DISPLAY[0]
    called = adapter_name(files, node) or ""
    kinds = (_MAINBOARD, _DISPLAY)
    return next((whose for whose, pattern in kinds if re.search(pattern, called)), None)


def bound_addresses(files: SystemFiles, node: str) -> list[Bound]:
    """Every address of a bus that a driver of the kernel's holds."""
    found = []
    for path in files.matching(f"/sys/bus/i2c/devices/{adapter_number(files, node)}-*/driver"):
        address = path.split("/")[-2].partition("-")[2]
        found.append(Bound(node, int(address, 16), files.path(path).resolve().name))
    return found
