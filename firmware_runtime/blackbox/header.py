"""What a recording says of itself: which robot, which settings, which code, which machine."""

from typing import Any

from msgspec import Struct


class Header(Struct, frozen=True, kw_only=True):
    """The first section of every chunk."""

    run: str
    """A name of the run that no other has."""
    board: str
    """The robot's own name; with its role, where it is one end of two."""
    kind: str
    fingerprint: str
    """SHA-256 over the board's file and the overrides."""
    source: str
    table: dict[str, Any]
    """The board's settings, overrides included."""
    role: str | None
    """The role that the process played; None for the whole robot."""
    has_world: bool
    """Whether its doubles were in the same process, and their world's models in the model."""
    clock: str
    speed: float
    takes_time: bool = True
    """Whether functions of models are timed: not in virtual time without statistics."""
    lines: list[str]
    """Names of buses and ports, in order of their numbers."""
    early: list[str]
    """Those of the buses that answer before a transaction has ended on the wire."""
    ports: list[str]
    """Output ports by path below the root, in order of their numbers."""
    world: list[str]
    """Paths of the atomics that are not the robot's own."""
    code: dict[str, str]
    """SHA-256 by module of the source of the model's classes."""
    code_sha256: str
    versions: dict[str, str | None]
    chance: Any = None
    """Where the process's generators of random numbers stood before the robot was built."""
