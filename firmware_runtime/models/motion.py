"""The value a controller regulates: where something is and how fast it changes."""

from typing import NamedTuple


class Motion(NamedTuple):
    """A measured coordinate and its rate: m and m/s, or rad and rad/s."""

    position: float
    rate: float
