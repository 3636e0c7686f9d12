"""Output interlock and enable line: what lets commands reach an actuator.

The interlock is checked before every write that could move an actuator. A stop never checks it.
While outputs are disabled a model keeps them full-off; what it does with commands that come
meanwhile is its own: a controller's are stale at once, a mission's are kept.

The enable line is a GPIO line at the OE pins of PWM chips. It is wired so that outputs are off
while no process holds it (PCA9685: OE is low-active, with a resistor to the supply). The process
that drives the outputs holds it; the kernel frees the line however that process ends.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TypeAlias

from firmware_runtime.devs.time import MILLISECOND, NEVER

Interlock: TypeAlias = Callable[[], bool]
"""Returns whether outputs are enabled."""


class NotedInterlock(ABC):
    """Interlock that notes each of its answers once it has a list for them: one frame, not two."""

    answers: list[bool] | None = None

    @abstractmethod
    def __call__(self) -> bool:
        """Return whether outputs are enabled; append that to `answers` where there are any."""


POLL_PERIOD = 20 * MILLISECOND
"""Ns between two checks by a model that keeps its commands."""


class _AlwaysEnabled:
    """Interlock of outputs that no supervision decides about; it need not be polled."""

    is_constant = True

    def __call__(self) -> bool:
        """Return True."""
        return True


always_enabled = _AlwaysEnabled()


def poll_period(interlock: Interlock) -> int:
    """Return the ns between two checks of an interlock; NEVER for one that `is_constant`."""
    return NEVER if getattr(interlock, "is_constant", False) else POLL_PERIOD


class EnableLine(ABC):
    """Held from construction to `close`, outputs disabled until `set(True)`."""

    name: str

    @abstractmethod
    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not. Raises BusFault if the line fails, PortClosed after close."""

    @abstractmethod
    def close(self) -> None:
        """Disable the outputs and give the line up; closing twice is harmless."""
