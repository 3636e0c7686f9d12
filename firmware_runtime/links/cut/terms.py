"""The terms of a link: `[link]` of the board, in ns, and which ports are retained or ordered."""

from dataclasses import dataclass

from firmware_runtime.devs.time import SECOND


@dataclass(frozen=True, slots=True)
class Terms:
    """How the two ends of a cut get on; ports by the path of the output port."""

    timeout: int = SECOND // 2
    good: int = SECOND // 2
    keep: int = 1
    retain: frozenset[str] = frozenset()
    ordered: frozenset[str] = frozenset()
