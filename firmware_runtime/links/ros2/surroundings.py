"""What ends a process of ROS without a sentence, or puts it where it is not expected.

ROS takes a domain of `-1` for 0 and `010` for 8, and its middleware ends the process for one over
232. Its libraries die of a bus error where shared memory is full to the last page.
"""

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from firmware_runtime.errors import ConfigError

DOMAIN: Final = "ROS_DOMAIN_ID"
HIGHEST_DOMAIN: Final = 232
"""Those above it have no ports."""
SHARED_MEMORY: Final = Path("/dev/shm")  # noqa: S108 -- where the C library has it
ROOM: Final = 1_000_000
"""Bytes that must be free there: a node's participant takes 0.7 MB."""


def check_surroundings(
    variables: Mapping[str, str], shared_memory: Path = SHARED_MEMORY, room: int = ROOM
) -> None:
    """Raise ConfigError for what a node cannot start with, all at once."""
    if faults := [*_of_domain(variables.get(DOMAIN, "")), *_of_memory(shared_memory, room)]:
        raise ConfigError("ros2", faults)


def _of_domain(stated: str) -> list[str]:
    is_number = re.fullmatch(r"0|[1-9][0-9]{0,2}", stated) is not None
    if stated == "" or (is_number and int(stated) <= HIGHEST_DOMAIN):
        return []
    return [f"{DOMAIN}: {stated!r}: expected a number from 0 to {HIGHEST_DOMAIN}"]


def _of_memory(shared_memory: Path, room: int) -> list[str]:
    with suppress(OSError):  # without it, nodes speak by the network alone
        found = os.statvfs(shared_memory)
        free = found.f_bavail * found.f_frsize
        if found.f_blocks > 0 and free < room:  # one without blocks has no limit
            return [f"{shared_memory}: {free // 1000} kB free, expected {room // 1000} or more"]
    return []
