"""The paper's blocks of a model that is about to run, and what carries their texts."""

from typing import TYPE_CHECKING

from firmware_runtime.executive.loop import Executive
from firmware_runtime.links.dover.blocks import DoverBlocks

if TYPE_CHECKING:
    from firmware_runtime.links.dover.dover import DoverLink


def dover_link(blocks: DoverBlocks, executive: Executive) -> "DoverLink | None":
    """Let the blocks speak from now on; None for a model that has none, which starts faster.

    Raises ConfigError if a port is taken.
    """
    if not blocks:
        return None
    from firmware_runtime.links.dover.dover import DoverLink  # noqa: PLC0415 -- starts processes

    return DoverLink(blocks, executive)
