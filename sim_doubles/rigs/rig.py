"""A rig whose buses are register-level doubles in this process."""

from collections.abc import Mapping
from typing import Protocol, cast

from firmware_runtime.board import rigs
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles, Rig
from firmware_runtime.hal.line_time import WireClock
from sim_doubles.i2c_bus import I2cBusDouble


class ServedRig(Doubles, Protocol):
    """What is served, plugged in or given faults: buses with transactions, warnings and faults."""

    @property
    def buses(self) -> Mapping[str, I2cBusDouble]:
        """The buses by their names."""

    def catch_up(self) -> None:
        """Let sensors that sample by themselves take what they have to, and the world go on."""

    def levels(self, at: int) -> dict[str, float]:
        """How each output stands at `at`, not in the past: a share of its time, or rad/s."""

    def next_change_at(self, at: int) -> int:
        """The first instant after `at` at which an output changes if no command comes."""


class DoublesRig(Rig, ServedRig, Protocol):
    """A board's rig in this process."""


def rig_for(board: Board, clock: WireClock) -> DoublesRig:
    """The board's doubles on this clock, found by entry point. Raises ConfigError."""
    return cast("DoublesRig", rigs.rig_for(board, clock))
