"""Output interlock: checked before every write that could move an actuator.

A stop never checks it. While outputs are disabled a model keeps them full-off; what it does with
commands that come meanwhile is its own: a controller's are stale at once, a mission's are kept.
"""

from collections.abc import Callable
from typing import TypeAlias

from firmware_runtime.devs.time import MILLISECOND, NEVER

Interlock: TypeAlias = Callable[[], bool]
"""Returns whether outputs are enabled."""

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
