"""The detective robot's chips, each as board.toml chooses it."""

from boards.detective.settings import (
    CompassTable,
    DetectiveSettings,
    RadarMotorTable,
    SonarTable,
    TreadsTable,
)
from drivers.chips import cmps12, md25, sabertooth, srf08
from drivers.chips.cmps12 import Cmps12
from drivers.chips.h_bridge import HBridge
from drivers.chips.hmc5883l import Hmc5883l
from drivers.chips.maxbotix import Maxbotix
from drivers.chips.md25 import Md25, Md25Settings
from drivers.chips.pca9685 import Pca9685
from drivers.chips.sabertooth import Sabertooth, SabertoothSettings
from drivers.chips.srf08 import Srf08, Srf08Settings
from drivers.compass import BearingSensor, CompassSettings
from drivers.radar_motor import RadarMotorSettings
from drivers.sonar import RangeFinder, SonarSettings
from drivers.treads import TreadDriver, TreadSettings
from firmware_runtime.board.lines import Lines
from firmware_runtime.devs.time import NEVER, seconds


def sonar(table: SonarTable, lines: Lines) -> RangeFinder:
    """An SRF08 or a MaxBotix."""
    if table.chip == "maxbotix":
        return Maxbotix(lines.ports[str(table.port)], table.family)
    settings = Srf08Settings(max_range_m=table.max_range_m, gain=table.gain)
    address = _known(table.address, srf08.SHIPPED_AT)
    return Srf08(lines.buses[str(table.bus)], address, settings)


def compass(table: CompassTable, lines: Lines) -> BearingSensor:
    """A CMPS12 or an HMC5883L."""
    if table.chip == "hmc5883l":
        return Hmc5883l(lines.buses[table.bus])
    return Cmps12(lines.buses[table.bus], _known(table.address, cmps12.SHIPPED_AT))


def treads(table: TreadsTable, lines: Lines) -> TreadDriver:
    """An MD25 or a Sabertooth."""
    if table.driver == "sabertooth":
        settings = SabertoothSettings(timeout_ns=seconds(table.timeout_s))
        address = _known(table.address, sabertooth.SHIPPED_AT)
        return Sabertooth(lines.ports[str(table.port)], address, settings)
    return Md25(
        lines.buses[str(table.bus)],
        _known(table.address, md25.SHIPPED_AT),
        Md25Settings(acceleration=table.acceleration),
    )


def bridge_chip(table: RadarMotorTable, lines: Lines) -> Pca9685:
    """The PCA9685 of the radar's motor."""
    return Pca9685(lines.buses[table.bus], table.address, osc_hz=table.osc_hz)


def bridge(table: RadarMotorTable, chip: Pca9685) -> HBridge:
    """The H-bridge channel on it."""
    return HBridge(chip, table.pwm_channel, table.in1, table.in2)


def sonar_settings(table: SonarTable) -> SonarSettings:
    """How often to range, and what counts as near."""
    return SonarSettings(seconds(table.period_s), table.threshold_m, table.only_entering)


def compass_settings(table: CompassTable) -> CompassSettings:
    """How often to read, and how headings count; the model compares whole degrees."""
    return CompassSettings(
        period=seconds(table.period_s),
        whole_degrees=True,
        counterclockwise=table.counterclockwise,
        offset_deg=table.offset_deg,
        stuck_after=table.stuck_after,
    )


def tread_settings(table: TreadsTable) -> TreadSettings:
    """What a signal means to the treads."""
    return TreadSettings(
        speed=table.speed,
        refresh=seconds(table.refresh_s),
        left_reversed=table.left_reversed,
        right_reversed=table.right_reversed,
        command_timeout=NEVER,
    )


def radar_motor_settings(settings: DetectiveSettings) -> RadarMotorSettings:
    """How fast the head turns, and for how long without an order."""
    table = settings.radar_motor
    return RadarMotorSettings(table.duty, table.frequency_hz, seconds(table.longest_turn_s))


def _known(address: int | None, shipped_at: int) -> int:
    """The address of a chip: the one stated, or that of every new one."""
    return shipped_at if address is None else address
