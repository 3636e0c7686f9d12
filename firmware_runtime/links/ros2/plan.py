"""Plan of a node: all that it is given when it starts, since it cannot read the board.

So an environment of ROS needs this project, and none of the packages that robots come from.
"""

from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from firmware_runtime.board.ros.names import node_name
from firmware_runtime.board.setting_descriptions import Setting

LEASE_S: Final = 0.4
"""Outputs are off within half a second and a period of the node's end."""


class Plan(Struct, frozen=True, kw_only=True):
    """One robot's node."""

    board: str
    """The robot's own name."""
    statistics: str
    """Where its run keeps its statistics, and its sockets beside them."""
    program: tuple[str, ...]
    """The command that starts this program in its own environment."""
    source: str
    """The board as the command line names it, a kind or the path of a file."""
    assignments: tuple[str, ...] = ()
    """Overrides of its file."""
    settings: dict[str, Setting] = {}
    """What may be set while it runs, by key."""
    topics: dict[str, Any] = {}
    """Its ports as topics, a `board.ros.written.table_of`."""
    doubles: str | None = None
    """Where doubles are served that the run drives, for `safe-state`."""
    configures_itself: bool = False
    """Whether it is configured as soon as there is a run."""
    lease_s: float = LEASE_S
    """For so long without a sign of life from the node, and the run disarms."""

    @property
    def node(self) -> str:
        """The node's name, which is also its namespace: the board's, as ROS allows it."""
        return node_name(self.board)

    @property
    def statistics_path(self) -> Path:
        """The same as a path."""
        return Path(self.statistics)

    def written(self) -> str:
        """One word of a command line."""
        return msgspec.json.encode(self).decode()


def read_plan(word: str) -> Plan:
    """A plan that was `written`."""
    return msgspec.json.decode(word, type=Plan)
