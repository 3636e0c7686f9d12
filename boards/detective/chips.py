"""The radar's motor as board.toml describes it; the other chips know their own tables."""

from boards.detective.settings import RadarMotorTable
from drivers.chips.h_bridge import HBridge
from drivers.chips.pca9685 import Pca9685
from drivers.radar_motor import RadarMotorSettings
from firmware_runtime.board.lines import Lines
from firmware_runtime.devs.time import seconds


def bridge_chip(table: RadarMotorTable, lines: Lines) -> Pca9685:
    """The PCA9685 of the radar's motor."""
    return Pca9685(lines.buses[table.bus], table.address, osc_hz=table.osc_hz)


def bridge(table: RadarMotorTable, chip: Pca9685) -> HBridge:
    """The H-bridge channel on it."""
    return HBridge(chip, table.pwm_channel, table.in1, table.in2)


def radar_motor_settings(table: RadarMotorTable) -> RadarMotorSettings:
    """How fast the head turns, and for how long without a command."""
    return RadarMotorSettings(table.duty, table.frequency_hz, seconds(table.longest_turn_s))
