"""Output interlock: checked before every write that could move an actuator.

A stop never checks it. While outputs are disabled a model keeps them full-off; what it does with
commands that come meanwhile is its own: a controller's are stale at once, a mission's are kept.
"""

from collections.abc import Callable
from typing import TypeAlias

from firmware_runtime.devs.time import MILLISECOND

Interlock: TypeAlias = Callable[[], bool]
"""Returns whether outputs are enabled."""

POLL_PERIOD = 20 * MILLISECOND
"""Ns between two checks by a model that keeps its commands."""


def always_enabled() -> bool:
    """Return True: no supervision decides about these outputs."""
    return True
