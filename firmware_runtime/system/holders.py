"""Which other processes have a device node open, as far as /proc shows their files."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from firmware_runtime.system.files import SystemFiles


class Holder(NamedTuple):
    """A process, and the node it has open."""

    process: int
    command: str
    node: str


class Holders(NamedTuple):
    """What was found, and how many processes hide their files from this user."""

    found: list[Holder]
    hidden: int


def holders(files: SystemFiles, nodes: Collection[str]) -> Holders:
    """The processes besides this one that have one of these nodes open."""
    targets = {os.path.realpath(files.path(node)): node for node in nodes}
    found: list[Holder] = []
    hidden = 0
    for name in _processes(files):
        opened = _opened(files, name)
        hidden += opened is None
        held = {targets[target] for target in opened or () if target in targets}
        found += (Holder(int(name), _command(files, name), node) for node in sorted(held))
    return Holders(found, hidden)


def _processes(files: SystemFiles) -> list[str]:
    names = (path.rpartition("/")[2] for path in files.matching("/proc/[0-9]*"))
    return [name for name in names if name.isdecimal() and int(name) != os.getpid()]


def _opened(files: SystemFiles, process: str) -> set[str] | None:
    """What a process has open; None if it may not be seen, nothing if it has just ended."""
    folder = files.path(f"/proc/{process}/fd")
    try:
        descriptors = list(folder.iterdir())
    except FileNotFoundError:
        return set()
    except OSError:
        return None
    return {target for each in descriptors if (target := _target(each)) is not None}


def _target(descriptor: Path) -> str | None:
    try:
        return str(descriptor.readlink())
    except OSError:
        return None


def _command(files: SystemFiles, process: str) -> str:
    return files.text(f"/proc/{process}/comm") or "a process without a name"
