"""The way a bridge carries datagrams."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.links.addresses import Endpoint


@dataclass(frozen=True, slots=True)
class Route:
    """What a bridge carries: from where to where."""

    robot: Path
    """The run's ports socket."""
    listen: Endpoint
    peers: Sequence[Endpoint] = ()
    watch: Sequence[str] = ()
    """Output ports for the peers, every N-th message of each."""
    every: int = 1
