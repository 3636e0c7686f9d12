"""The enable line of a rig, where the board has one: at the OE pins of some PCA9685.

It is pulled to disable them while it is free.
"""

from collections.abc import Sequence

from firmware_runtime.board.settings import OutputEnableSettings
from firmware_runtime.hal.enable_line import EnableLine
from firmware_runtime.hal.wire_errors import PortClosed
from sim_doubles.chips.pca9685 import Pca9685Double


class EnableLineDouble(EnableLine):
    """A line that is held from construction on, with the outputs of `chips` disabled."""

    def __init__(self, name: str, chips: Sequence[Pca9685Double]) -> None:
        self.name = name
        self._chips = chips
        self._closed = False
        self._let_through(enabled=False)

    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not."""
        if self._closed:
            raise PortClosed("the line was used after it was closed", where=self.name)
        self._let_through(enabled=enabled)

    def close(self) -> None:
        """Free the line: the resistor disables the outputs."""
        self._closed = True
        self._let_through(enabled=False)

    def _let_through(self, *, enabled: bool) -> None:
        for chip in self._chips:
            chip.output_enabled = enabled


def enable_line(
    wired: OutputEnableSettings | None, chips: Sequence[Pca9685Double]
) -> EnableLineDouble | None:
    """The double of the line at the OE pins of these chips; None where OE lies at ground."""
    return None if wired is None else EnableLineDouble("output_enable", chips)
