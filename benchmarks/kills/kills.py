"""What became of the kills of one part of a robot."""

from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median
from typing import Any, Final

from benchmarks.kills.killed import Killed
from firmware_runtime.devs.time import MILLISECOND

GOAL_MS: Final = 510.0
"""`timeout_s` of a link, 0.5 s, and one period of TachoBot's loop."""
STAYS_OFF: Final = 500 * MILLISECOND
"""No output comes on sooner after all went off, ns: a link has to be good for so long."""


@dataclass(slots=True)
class Kills:
    """How long after each kill all outputs were off, and how many times they stayed so.

    Counted from just before the kill.
    """

    took_ms: list[float] = field(default_factory=list)
    stayed_off: int = 0
    known_to_ms: float = 0.0
    """How much later than that a kill may have come, at worst."""
    beyond: list[tuple[float, float | None]] = field(default_factory=list)
    """Of those beyond the goal: how long, and for how long the machine stood still meanwhile."""

    def note(
        self,
        killed: Killed,
        off_at: int,
        on_at: int | None,
        stood_still_ms: Callable[[int, int], float | None] = lambda _begin, _end: None,
    ) -> None:
        """One more, by instants in ns."""
        took_ms = (off_at - killed.before) / 1e6
        self.took_ms.append(took_ms)
        self.known_to_ms = max(self.known_to_ms, (killed.after - killed.before) / 1e6)
        self.stayed_off += on_at is None or on_at - off_at >= STAYS_OFF
        if took_ms > GOAL_MS:
            self.beyond.append((round(took_ms, 3), stood_still_ms(killed.before, off_at)))

    def add(self, others: "Kills") -> None:
        """Those of another batch."""
        self.took_ms += others.took_ms
        self.stayed_off += others.stayed_off
        self.known_to_ms = max(self.known_to_ms, others.known_to_ms)
        self.beyond += others.beyond

    def report(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "kills": len(self.took_ms),
            "within": sum(each <= GOAL_MS for each in self.took_ms),
            "median_ms": median(self.took_ms),
            "worst_ms": max(self.took_ms),
            "stayed_off": self.stayed_off,
            "known_to_ms": round(self.known_to_ms, 3),
            "beyond": [{"took_ms": took, "stood_still_ms": still} for took, still in self.beyond],
            "took_ms": [round(each, 3) for each in self.took_ms],
        }
