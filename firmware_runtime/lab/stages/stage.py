"""The four stages of a robot whose controller never changes.

Source: Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), Winter Simulation Conference 2018,
section 3.
"""

from enum import StrEnum


class Stage(StrEnum):
    """Places of controller and plant, and the link between them."""

    SIMULATION = "simulation"
    """Both in one process, on doubles, in virtual time."""
    NETWORK = "network"
    """Two processes of this machine in real time, the plant on doubles, a network between them."""
    REMOTE = "remote"
    """The controller here, the robot end on another machine, or behind a bad network."""
    EMBEDDED = "embedded"
    """Both in one process in real time, on chips or on doubles."""

    @property
    def has_two_ends(self) -> bool:
        """Return whether controller and robot end are processes of their own."""
        return self in {Stage.NETWORK, Stage.REMOTE}
