"""What a recording says of itself: which robot, which settings, which code, which machine."""

import math
from typing import Any

import msgspec

from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.recording.recorded_board import RecordedBoard


class Header(RecordedBoard, frozen=True, kw_only=True):
    """The first section of every chunk; the name is with its role where it is one end of two."""

    run: str
    """A name of the run that no other has."""
    began: tuple[int, int] | None = None
    """CLOCK_MONOTONIC and the system's time as the recording began, ns."""
    role: str | None
    """The role that the process played; None for the whole robot."""
    has_world: bool
    """Whether its doubles were in the same process, and their world's models in the model."""
    speed: float
    lines: list[str]
    """Names of buses and ports, in order of their numbers."""
    early: list[str]
    """Those of the buses that answer before a transaction has ended on the wire."""
    ports: list[str]
    """Output ports by path below the root, in order of their numbers."""
    world: list[str]
    """Paths of the atomics that are not the robot's own."""
    chance: Any = None
    """Where the process's generators of random numbers stood before the robot was built."""


def header_in(content: bytes) -> Header | None:
    """The header that a section is; None for what is none."""
    try:
        section = decode(content)
        header = msgspec.convert(section.extra, Header)
    except msgspec.MsgspecError:
        return None
    is_one = section.kind is Kind.HEADER and 0 <= header.speed < math.inf
    return header if is_one else None
