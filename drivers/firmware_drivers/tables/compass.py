"""A compass on I2C: a CMPS12 (or CMPS14), or an HMC5883L at its one address."""

from typing import TypeAlias

from firmware_drivers.chips import cmps12, hmc5883l
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l
from firmware_drivers.compass import CompassSettings
from firmware_runtime.board.faults import Device, Recurring
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import Address, Seconds, Settings
from firmware_runtime.devs.time import seconds


class CompassKeys(Settings, frozen=True, kw_only=True, tag_field="chip"):
    """Keys of every compass."""

    bus: str
    period_s: Seconds
    counterclockwise: bool = False
    """Headings grow to the left, as those of a compass mounted upside down do."""
    offset_deg: float = 0.0

    def model(self, *, whole_degrees: bool) -> CompassSettings:
        """Return the period of readings, and the sense of headings."""
        return CompassSettings(
            period=seconds(self.period_s),
            whole_degrees=whole_degrees,
            counterclockwise=self.counterclockwise,
            offset_deg=self.offset_deg,
        )


class Cmps12Table(CompassKeys, frozen=True, kw_only=True, tag="cmps12"):
    """A CMPS12 or CMPS14."""

    address: Address

    def chip(self, lines: Lines) -> Cmps12:
        """The chip on its bus."""
        return Cmps12(lines.buses[self.bus], self.address, period_ns=seconds(self.period_s))

    def device(self, key: str) -> Device:
        """Return its place."""
        return Device(key, "CMPS12", self.bus, self.address, stretches_clock=True)

    def recurring(self, key: str) -> tuple[Recurring, ...]:
        """Return its load of its bus."""
        return (Recurring(self.bus, f"{key} heading", cmps12.TRAFFIC, seconds(self.period_s)),)


class Hmc5883lTable(CompassKeys, frozen=True, kw_only=True, tag="hmc5883l"):
    """An HMC5883L."""

    def chip(self, lines: Lines) -> Hmc5883l:
        """The chip on its bus."""
        return Hmc5883l(lines.buses[self.bus])

    def device(self, key: str) -> Device:
        """Return its place."""
        return Device(key, "HMC5883L", self.bus, hmc5883l.ADDRESS)

    def recurring(self, key: str) -> tuple[Recurring, ...]:
        """Return its load of its bus."""
        return (Recurring(self.bus, f"{key} heading", hmc5883l.TRAFFIC, seconds(self.period_s)),)


CompassTable: TypeAlias = Cmps12Table | Hmc5883lTable
