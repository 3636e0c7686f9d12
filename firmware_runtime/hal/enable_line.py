"""The line that lets a board's PWM outputs through at all: a GPIO line at the chips' OE pins.

It is wired so that outputs are off while no process holds the line (PCA9685: OE is low-active, with
a resistor to the supply). The process that drives the outputs holds it; the kernel frees the line
however that process ends.
"""

from abc import ABC, abstractmethod


class EnableLine(ABC):
    """Held from construction to `close`, outputs disabled until `set(True)`."""

    name: str

    @abstractmethod
    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not. Raises BusFault if the line fails, PortClosed after close."""

    @abstractmethod
    def close(self) -> None:
        """Disable the outputs and give the line up; closing twice is harmless."""
