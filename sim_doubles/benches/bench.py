"""What every bench offers to whoever runs a robot on doubles."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.hal.serial import SerialPort
from sim_doubles.i2c_bus import I2cBusDouble


class Bench(Protocol):
    """Doubles on buses, and the world behind them."""

    @property
    def buses(self) -> Mapping[str, I2cBusDouble]:
        """The buses by their names in board.toml."""

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """The serial ports by their names in board.toml."""

    @property
    def shown(self) -> OutPort[float]:
        """The port whose values a person wants to see over time."""

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe beside the robot's own models."""

    def result(self, at: int) -> dict[str, object]:
        """How the run ended at instant `at`, by the true state of the world."""

    @property
    def outputs(self) -> dict[str, int]:
        """How many outputs of each actuating chip are on."""


@runtime_checkable
class Drawn(Protocol):
    """A bench that can show a run as a picture."""

    def draw(self, until: int) -> str:
        """The run up to an instant, as SVG."""
