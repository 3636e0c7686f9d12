"""The driver of two treads: an MD25 on I2C, or a Sabertooth on a serial port."""

from dataclasses import replace
from typing import Annotated, TypeAlias

from msgspec import Meta

from firmware_drivers.chips import md25, sabertooth
from firmware_drivers.chips.md25 import Md25, Md25Settings
from firmware_drivers.chips.sabertooth import Sabertooth, SabertoothSettings
from firmware_drivers.treads import TreadSettings
from firmware_runtime.board.faults import Device, Recurring, SerialDevice
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import Address, Seconds, Settings
from firmware_runtime.devs.time import seconds

Share = Annotated[float, Meta(gt=0, le=1)]


class TreadKeys(Settings, frozen=True, kw_only=True, tag_field="driver"):
    """Keys of every driver."""

    speed: Annotated[Share, Meta(description="Share of full speed that signals 1 and 2 stand for.")]
    refresh_s: Seconds
    """The last speeds are sent again this often while moving."""
    left_reversed: bool = False
    right_reversed: bool = False

    @property
    def model(self) -> TreadSettings:
        """Return a signal's meaning and period; a command holds until the next."""
        return TreadSettings(
            speed=self.speed,
            refresh=seconds(self.refresh_s),
            left_reversed=self.left_reversed,
            right_reversed=self.right_reversed,
        )

    def recurring(self, key: str) -> tuple[Recurring, ...]:  # noqa: ARG002 -- as of every table
        """Return its load of its bus; none of a chip on a serial port."""
        return ()


class Md25Table(TreadKeys, frozen=True, kw_only=True, tag="md25"):
    """An MD25."""

    bus: str
    address: Address
    acceleration: Annotated[int, Meta(ge=1, le=10)] = 5
    """Speed steps (of 127) every 25 ms. With 5, as at power-up, a lost supply is not found."""
    full_counts_s: Annotated[float, Meta(gt=0)] | None = None
    """Counts of an encoder in a second at full speed, for the check that wheels turn as told."""

    @property
    def model(self) -> TreadSettings:
        """Return that of every driver, and what the wheels are checked by."""
        ramp = md25.FULL * md25.STEP_NS // self.acceleration
        return replace(super().model, full_counts_s=self.full_counts_s, ramp=ramp)

    def chip(self, lines: Lines) -> Md25:
        """The chip on its bus."""
        settings = Md25Settings(acceleration=self.acceleration)
        return Md25(lines.buses[self.bus], self.address, settings)

    def device(self, key: str) -> Device:
        """Return its place."""
        return Device(key, "MD25", self.bus, self.address, stretches_clock=True)

    def recurring(self, key: str) -> tuple[Recurring, ...]:
        """Return its load of its bus."""
        return (Recurring(self.bus, f"{key} speeds", md25.TRAFFIC, seconds(self.refresh_s)),)


class SabertoothTable(TreadKeys, frozen=True, kw_only=True, tag="sabertooth"):
    """A Sabertooth."""

    port: str
    address: int = sabertooth.SHIPPED_AT
    timeout_s: Seconds = 0.3
    """Silence after which it stops by itself, in whole tenths."""

    def chip(self, lines: Lines) -> Sabertooth:
        """The driver on its port."""
        settings = SabertoothSettings(timeout_ns=seconds(self.timeout_s))
        return Sabertooth(lines.ports[self.port], self.address, settings)

    def device(self, key: str) -> SerialDevice:
        """Return its place."""
        return SerialDevice(key, "Sabertooth", self.port, address=self.address)


TreadTable: TypeAlias = Md25Table | SabertoothTable
