"""A sonar: an SRF08 on I2C, or a MaxBotix on a serial port."""

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from firmware_drivers.chips import maxbotix, srf08
from firmware_drivers.chips.maxbotix import Maxbotix
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.sonar import SonarSettings
from firmware_runtime.board.faults import Device, Recurring, SerialDevice
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import Address, Positive, Seconds, Settings
from firmware_runtime.devs.time import seconds


class SonarKeys(Settings, frozen=True, kw_only=True, tag_field="chip"):
    """Keys of every sonar."""

    period_s: Seconds
    """From ping to ping."""
    threshold_m: Positive
    """An echo from here or nearer is a detection."""
    only_entering: bool = False
    """A detection is only what was not there, or farther, at the ping before."""
    detection_pings: Annotated[int, Meta(ge=1)] = 1
    """Pings in a row that find something near before it is a detection."""

    @property
    def model(self) -> SonarSettings:
        """Return the period of ranging, and the distance that counts as near."""
        return SonarSettings(
            seconds(self.period_s),
            self.threshold_m,
            self.only_entering,
            detection_pings=self.detection_pings,
        )

    def recurring(self, key: str) -> tuple[Recurring, ...]:  # noqa: ARG002 -- as of every table
        """Return its load of its bus; none of a chip on a serial port."""
        return ()


class Srf08Table(SonarKeys, frozen=True, kw_only=True, tag="srf08"):
    """An SRF08."""

    bus: str
    address: Address
    max_range_m: Positive = 3.0
    gain: Annotated[int, Meta(ge=0, le=31)] = 31

    def chip(self, lines: Lines) -> Srf08:
        """The chip on its bus."""
        settings = Srf08Settings(max_range_m=self.max_range_m, gain=self.gain)
        return Srf08(lines.buses[self.bus], self.address, settings)

    def device(self, key: str) -> Device:
        """Return its place."""
        return Device(key, "SRF08", self.bus, self.address, stretches_clock=True)

    def recurring(self, key: str) -> tuple[Recurring, ...]:
        """Return its load of its bus."""
        return (Recurring(self.bus, f"{key} ranging", srf08.TRAFFIC, seconds(self.period_s)),)


class MaxbotixTable(SonarKeys, frozen=True, kw_only=True, tag="maxbotix"):
    """A MaxBotix."""

    port: str
    family: Literal["lv", "xl", "xl-10m", "hrlv", "hrxl-5m", "hrxl-10m"] = "xl"

    def chip(self, lines: Lines) -> Maxbotix:
        """The sonar on its port."""
        return Maxbotix(lines.ports[self.port], self.family)

    def device(self, key: str) -> SerialDevice:
        """Return its place."""
        return SerialDevice(key, "MaxBotix", self.port, maxbotix.BAUD)


SonarTable: TypeAlias = Srf08Table | MaxbotixTable
