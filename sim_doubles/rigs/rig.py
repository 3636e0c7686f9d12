"""A rig whose buses are register-level doubles in this process."""

from collections.abc import Mapping
from typing import Protocol, cast

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.runs import rigs
from sim_doubles.i2c_bus import I2cBusDouble


class DoublesRig(Rig, Protocol):
    """What is served, plugged in or given faults: buses with transactions, warnings and faults."""

    @property
    def buses(self) -> Mapping[str, I2cBusDouble]:
        """The buses by their names in board.toml."""


def rig_for(board: Board, clock: WireClock) -> DoublesRig:
    """The board's doubles on this clock, found by entry point. Raises ConfigError."""
    return cast("DoublesRig", rigs.rig_for(board, clock))
