"""The paper's blocks of a model that is about to run, and what carries their texts."""

import sys
from typing import TYPE_CHECKING

from firmware_runtime.executive.executive import Executive

if TYPE_CHECKING:
    from firmware_runtime.devs.component import Component
    from firmware_runtime.executive.clocks import Clock
    from firmware_runtime.links.dover.blocks import DoverBlocks
    from firmware_runtime.links.dover.dover import DoverLink


_BLOCKS = "firmware_runtime.models.dover"


def dover_blocks(model: "Component", clock: "Clock") -> "DoverBlocks | None":
    """Those of a model that is on no executive yet; None where their module was never loaded."""
    if _BLOCKS not in sys.modules:
        return None
    from firmware_runtime.links.dover.blocks import DoverBlocks  # noqa: PLC0415 -- few models have any

    return DoverBlocks(model, clock)


def dover_link(blocks: "DoverBlocks | None", executive: Executive) -> "DoverLink | None":
    """Let the blocks speak from now on; None for a model that has none, which starts faster.

    Raises ConfigError if a port is taken.
    """
    if not blocks:
        return None
    from firmware_runtime.links.dover.dover import DoverLink  # noqa: PLC0415 -- starts processes

    return DoverLink(blocks, executive)
