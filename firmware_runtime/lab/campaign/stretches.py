"""Stretches: runs of a campaign as parts of a job, each of which shares one healthy run.

What is known of healthy runs goes with the job: no process of it makes them again.

The runs of a stretch are spread evenly over the space. What was done first is spread as evenly as
all of it, so a campaign that is ended early has seen a fair share.
"""

from collections.abc import Collection, Sequence
from typing import Final

from msgspec import Struct

from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.space import Space
from firmware_runtime.lab.campaign.trial import forked, lost
from firmware_runtime.lab.sweeps.row import Row

FIRST: Final = 16
LARGEST: Final = 256
"""Runs of the first stretches, and of the largest."""


class Stretches(Struct, frozen=True, kw_only=True):
    """The runs of a campaign as parts of a job."""

    found: Healthy
    parts: tuple[tuple[int, ...], ...]
    """Numbers in the space, by part."""
    going_on: frozenset[int] = frozenset()
    """Those of runs that go on to the end of their mission."""
    until: float | None = None
    """The instant of the machine's clock after which none begins, but the very first."""
    oracle: Oracle | None = None

    def run(self, number: int) -> list[Row]:
        """Run one part."""
        part, is_first = self.parts[number], number == 0
        rows = forked(
            self.found,
            part,
            self.oracle,
            self.until,
            is_first=is_first,
            going_on=self.going_on,
        )
        return [*rows]

    def lost(self, number: int, why: str) -> list[Row]:
        """Return the rows of a part whose process ended each time it was tried."""
        mission, space = self.found.mission, Space(self.found)
        return [lost(mission, each, space[each], why) for each in self.parts[number]]


def in_parts(chosen: Sequence[int], done: Collection[int] = ()) -> tuple[tuple[int, ...], ...]:
    """Cut what is chosen into stretches, small ones first, without the runs that are done."""
    parts: list[tuple[int, ...]] = []
    begin, size, count = 0, FIRST, 0
    while begin < len(chosen):
        part = tuple(each for each in chosen[begin : begin + size] if each not in done)
        begin += size
        count += 1
        if count % 2 == 0:
            size = min(2 * size, LARGEST)
        if part:
            parts.append(part)
    return tuple(parts)
