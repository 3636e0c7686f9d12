"""A PCA9685's driver and double on one bus, on a clock that the steps' waits move."""

from collections.abc import Iterable

from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from tests.support.wired_pca9685 import WiredPca9685


def take(clock: ManualClock, steps: Iterable[Step]) -> None:
    """Take steps of a bring-up or a measurement, each with its wait."""
    for step in steps:
        step.action()
        clock.advance(step.wait_ns)


class DrivenPca9685(WiredPca9685):
    def __init__(self, true_osc_hz: float = 25e6) -> None:
        clock = ManualClock()
        super().__init__(clock, Pca9685Double(clock, true_osc_hz=true_osc_hz))

    def bring_up(self, frequency_hz: float = 1000, osc_hz: float = 25e6) -> Pca9685:
        driver = Pca9685(self.bus, osc_hz=osc_hz)
        take(self.clock, driver.bring_up(frequency_hz))
        return driver
