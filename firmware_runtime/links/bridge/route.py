"""The way a bridge carries datagrams: from where to where, and how many it has carried."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.links.endpoint import Endpoint


@dataclass(frozen=True, slots=True)
class Route:
    """What a bridge carries: from where to where."""

    robot: Path
    """The run's statistics: its socket is beside them."""
    listen: Endpoint
    peers: Sequence[Endpoint] = ()
    watch: Sequence[str] = ()
    """Output ports for the peers, every N-th message of each."""
    every: int = 1
    key: bytes | None = None
    """What senders and answers are signed with; without it `listen` is a loopback address."""


@dataclass(slots=True)
class Carried:
    """Datagrams since the bridge began."""

    to_robot: int = 0
    from_robot: int = 0
    dropped: int = 0
    """Those that found no room, no run, or no reader."""
