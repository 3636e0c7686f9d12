"""Leave to move: asked by every model that drives something, before each write that could move it.

A stop never asks. Without leave a model keeps its outputs full-off; what it does with orders that
come meanwhile is its own: a controller's are stale at once, a mission's are kept.
"""

from collections.abc import Callable
from typing import TypeAlias

from firmware_runtime.devs.time import MILLISECOND

Permit: TypeAlias = Callable[[], bool]

ASK_AGAIN_AFTER = 20 * MILLISECOND
"""Ns until a model whose orders are kept asks again."""


def always() -> bool:
    """Leave that is never withheld: nobody watches over these outputs."""
    return True
