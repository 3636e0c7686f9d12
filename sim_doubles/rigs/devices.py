"""Doubles of the tables in `firmware_drivers.tables`: each chip as its table says, on a rig."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from firmware_drivers.tables.compass import Cmps12Table, CompassTable
from firmware_drivers.tables.sonar import MaxbotixTable, SonarTable
from firmware_drivers.tables.treads import Md25Table, TreadTable

from firmware_runtime.board.settings import BusSettings
from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.hal.serial import SerialPort
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.motor_pair import MotorPair
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.rigs.buses import buses_of
from sim_doubles.serial_line import SerialLineDouble
from sim_doubles.serial_target import SerialTarget

FIELD_LEVEL_T = 20e-6
FIELD_UP_T = -40e-6


class Sampler(Protocol):
    """A double that samples by itself and must be up to date before the world moves on."""

    def catch_up(self) -> None:
        """Take every sample due up to now."""


class Wires:
    """Which double is on which line, while a rig is put together."""

    def __init__(self, buses: Mapping[str, BusSettings], clock: WireClock) -> None:
        self.clock = clock
        self.ports: dict[str, SerialPort] = {}
        self.samplers: list[Sampler] = []
        self._stated = buses
        self.targets: dict[str, list[Target]] = {name: [] for name in buses}

    def connect(self, bus: str, target: Target) -> None:
        """Put a double on a bus."""
        self.targets[bus].append(target)

    def plug_in(self, port: str, target: SerialTarget) -> None:
        """Put a double on a serial port."""
        self.ports[port] = SerialLineDouble(port, self.clock, target)

    def buses(self) -> dict[str, I2cBusDouble]:
        """The buses, once everything is on them."""
        return buses_of(self._stated, self.targets, self.clock)

    def catch_up(self) -> None:
        """Let the sensors that sample by themselves take what they still have to take."""
        for sampler in self.samplers:
            sampler.catch_up()


def add_treads(table: TreadTable, wires: Wires) -> MotorPair:
    """Add the driver of the treads; give its motors."""
    if isinstance(table, Md25Table):
        chip = Md25Double(wires.clock, table.address)
        wires.connect(table.bus, chip)
        return chip.motors
    driver = SabertoothDouble(wires.clock, table.address)
    wires.plug_in(table.port, driver)
    return driver.motors


def add_sonar(table: SonarTable, wires: Wires, echoes: Callable[[int], Sequence[float]]) -> None:
    """Add a sonar that receives the echoes of an instant, their distances in m, nearest first."""
    if isinstance(table, MaxbotixTable):
        sonar = MaxbotixDouble(
            wires.clock, lambda at: next(iter(echoes(at)), math.inf), family=table.family
        )
        wires.samplers.append(sonar)
        wires.plug_in(table.port, sonar)
    else:
        wires.connect(table.bus, Srf08Double(wires.clock, table.address, echoes=echoes))


def add_compass(
    table: CompassTable, wires: Wires, bearing_deg: Callable[[int], float], hangs_from: int = NEVER
) -> None:
    """Add a compass that points to the bearing of an instant, degrees clockwise from north.

    From `hangs_from` on, in ns, it answers the same.
    """
    if isinstance(table, Cmps12Table):
        chip = Cmps12Double(wires.clock, table.address, bearing_deg=bearing_deg)
        chip.hangs_from = hangs_from
        wires.connect(table.bus, chip)
    else:
        magnetometer = Hmc5883lDouble(wires.clock, lambda at: _field(bearing_deg(at)))
        magnetometer.hangs_from = hangs_from
        wires.samplers.append(magnetometer)
        wires.connect(table.bus, magnetometer)


def _field(bearing_deg: float) -> tuple[float, float, float]:
    """The earth's field in the axes of a level sensor whose x points to that bearing, z up."""
    bearing = math.radians(bearing_deg)
    return (FIELD_LEVEL_T * math.cos(bearing), FIELD_LEVEL_T * math.sin(bearing), FIELD_UP_T)
