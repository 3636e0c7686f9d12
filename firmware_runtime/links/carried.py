"""What a bridge has carried."""

from dataclasses import dataclass


@dataclass(slots=True)
class Carried:
    """Datagrams since the bridge began."""

    to_robot: int = 0
    from_robot: int = 0
    dropped: int = 0
    """Those that found no room, no run, or nobody."""
