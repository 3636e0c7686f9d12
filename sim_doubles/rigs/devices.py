"""Doubles of the tables in `firmware_drivers.tables`: each chip as its table says, on a rig."""

import math
from collections.abc import Callable, Sequence

from firmware_drivers.tables.compass import Cmps12Table, CompassTable
from firmware_drivers.tables.sonar import MaxbotixTable, SonarTable
from firmware_drivers.tables.treads import Md25Table, TreadTable

from firmware_runtime.devs.time import NEVER
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.motor_pair import MotorPair
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.rigs.board_rig import BoardRig

FIELD_LEVEL_T = 20e-6
FIELD_UP_T = -40e-6


def add_treads(table: TreadTable, rig: BoardRig) -> MotorPair:
    """Add the driver of the treads; give its motors."""
    if isinstance(table, Md25Table):
        chip = Md25Double(rig.now, table.address)
        rig.connect(table.bus, chip)
        return chip.motors
    driver = SabertoothDouble(rig.now, table.address)
    rig.plug_in(table.port, driver)
    return driver.motors


def add_sonar(table: SonarTable, rig: BoardRig, echoes: Callable[[int], Sequence[float]]) -> None:
    """Add a sonar that receives the echoes of an instant, their distances in m, nearest first."""
    if isinstance(table, MaxbotixTable):
        sonar = MaxbotixDouble(
            rig.now, lambda at: next(iter(echoes(at)), math.inf), family=table.family
        )
        rig.plug_in(table.port, sonar)
    else:
        rig.connect(table.bus, Srf08Double(rig.now, table.address, echoes=echoes))


def add_compass(
    table: CompassTable, rig: BoardRig, bearing_deg: Callable[[int], float], hangs_from: int = NEVER
) -> None:
    """Add a compass that points to the bearing of an instant, degrees clockwise from north.

    From `hangs_from` on, in ns, it answers the same.
    """
    if isinstance(table, Cmps12Table):
        chip = Cmps12Double(rig.now, table.address, bearing_deg=bearing_deg)
        chip.hangs_from = hangs_from
        rig.connect(table.bus, chip)
    else:
        magnetometer = Hmc5883lDouble(rig.now, lambda at: _field(bearing_deg(at)))
        magnetometer.hangs_from = hangs_from
        rig.connect(table.bus, magnetometer)


def _field(bearing_deg: float) -> tuple[float, float, float]:
    """The earth's field in the axes of a level sensor whose x points to that bearing, z up."""
    bearing = math.radians(bearing_deg)
    return (FIELD_LEVEL_T * math.cos(bearing), FIELD_LEVEL_T * math.sin(bearing), FIELD_UP_T)
