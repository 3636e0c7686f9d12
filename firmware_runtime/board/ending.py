"""What a robot says when its run is over by its own judgement."""

from typing import NamedTuple


class Ending(NamedTuple):
    """Why the run is over; `failed` when something went wrong."""

    reason: str
    failed: bool
