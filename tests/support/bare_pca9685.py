"""A PCA9685's driver on bare registers, as after power-up or brought up at 1 kHz."""

from collections.abc import Iterable

from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step

from firmware_runtime.hal.i2c import I2cBus
from tests.support.bare_chip import BareChip


class At1Khz(Pca9685):
    """The driver, brought up at one rate."""

    def bring_up(self, frequency_hz: float = 1000.0) -> tuple[Step, ...]:
        return super().bring_up(frequency_hz)


class BarePca9685(BareChip[At1Khz]):
    def __init__(self, *, running: bool = False, staggered: bool = False) -> None:
        def make(bus: I2cBus) -> At1Khz:
            return At1Khz(bus, staggered=staggered)

        powered_up = {0x00: b"\x11\x04\xe2\xe4\xe8\xe0", 0x09: b"\x10", 0xFE: b"\x1e"}
        super().__init__(make, 0x40, powered_up)
        self.hold({}, 0x00)
        if running:
            self.bring_up()
            self.bus.wire.clear()

    def take(self, steps: Iterable[Step]) -> None:
        for step in steps:
            step.action()
