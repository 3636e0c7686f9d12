"""Silence at an input port of the top model: how long a command from outside counts.

A value comes from another process (`send`, a bridge, ROS 2), which may end. So each input port of a
robot that has outputs has a timeout: outputs are off from then until the next value comes. A port
of references, settings or events is declared to `HOLD`: its last value counts until there is
another.
"""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.time import SECOND, seconds

TIMEOUT_S: Final = 0.5
"""Of a port of which nothing is declared."""
HOLD: Final = "hold"

Inputs: TypeAlias = Mapping[str, float | Literal["hold"]]
"""By the name of an input port of the top model, its timeout in seconds, or `HOLD`."""


def input_timeouts(board: Board, robot: Robot) -> dict[str, int | None]:
    """The timeout of each input port of the board's whole robot, ns; None where it holds.

    A robot without outputs has none to switch off.
    """
    return {
        name: _timeout(board.inputs.get(name, TIMEOUT_S)) if robot.stop else None
        for name in robot.model.in_ports
    }


def described(name: str, timeout: int | None) -> str:
    """Return what the silence of a port does, a few words."""
    if timeout is None:
        return f"input {name}: holds its last value"
    return f"input {name}: outputs are off {timeout / SECOND:g} s after its last value"


def _timeout(stated: float | str) -> int | None:
    return None if isinstance(stated, str) else seconds(stated)
