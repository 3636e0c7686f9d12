"""What became of the kills of one part of a robot."""

from dataclasses import dataclass, field
from statistics import median
from typing import Any, Final

from firmware_runtime.devs.time import MILLISECOND

GOAL_MS: Final = 510.0
"""`timeout_s` of a link, 0.5 s, and one period of TachoBot's loop."""
STAYS_OFF: Final = 500 * MILLISECOND
"""No output comes on sooner after all went off, ns: a link has to be good for so long."""


@dataclass(slots=True)
class Kills:
    """How long after each kill all outputs were off, and how many times they stayed so."""

    took_ms: list[float] = field(default_factory=list)
    stayed_off: int = 0

    def note(self, at: int, off_at: int, on_at: int | None) -> None:
        """One more, by instants in ns."""
        self.took_ms.append((off_at - at) / 1e6)
        self.stayed_off += on_at is None or on_at - off_at >= STAYS_OFF

    def add(self, others: "Kills") -> None:
        """Those of another batch."""
        self.took_ms += others.took_ms
        self.stayed_off += others.stayed_off

    def report(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "kills": len(self.took_ms),
            "within": sum(each <= GOAL_MS for each in self.took_ms),
            "median_ms": median(self.took_ms),
            "worst_ms": max(self.took_ms),
            "stayed_off": self.stayed_off,
            "took_ms": [round(each, 3) for each in self.took_ms],
        }
