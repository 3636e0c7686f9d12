"""The enable line of a rig, where the board has one."""

from collections.abc import Sequence

from firmware_runtime.board.settings import OutputEnableSettings
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.enable_line import EnableLineDouble


def enable_line(
    wired: OutputEnableSettings | None, chips: Sequence[Pca9685Double]
) -> EnableLineDouble | None:
    """The double of the line at the OE pins of these chips; None where OE lies at ground."""
    return None if wired is None else EnableLineDouble("output_enable", chips)
