"""A PCA9685's double on a bus of its own, in a world that notes what it was told."""

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
