"""A PCA9685's double on a bus of its own, in a world that notes what it was told; with a driver."""

from firmware_drivers.chips.pca9685 import Pca9685

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip


class WiredPca9685(WiredChip[Pca9685Double]):
    """The chip, and its duties before each change that the world was told of."""

    def __init__(self, clock: ManualClock, chip: Pca9685Double | None = None) -> None:
        chip = chip or Pca9685Double(clock)
        super().__init__(clock, chip, 0x40, [chip])
        self.before: list[tuple[float, ...]] = []
        self.chip.before_change = lambda: self.before.append(self.chip.duties)


class DrivenPca9685(WiredPca9685):
    """The chip as after power-up and its driver, on a clock that the steps' waits move."""

    def __init__(self, osc_hz: float = 25e6, *, staggered: bool = False) -> None:
        clock = ManualClock()
        super().__init__(clock, Pca9685Double(clock, true_osc_hz=osc_hz))
        self.driver = Pca9685(self.bus, osc_hz=osc_hz, staggered=staggered)

    def bring_up(self, frequency_hz: float = 1000) -> Pca9685:
        self.take(self.driver.bring_up(frequency_hz))
        self.sent()
        return self.driver
