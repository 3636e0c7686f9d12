"""A span of the timeline as a chart draws it: as wide as it was long.

The timeline is fine at its end and coarse before.
"""

from collections.abc import Sequence
from typing import NamedTuple

from firmware_runtime.statistics.page.scales import TimeScale
from firmware_runtime.statistics.page.words import instant
from firmware_runtime.statistics.timeline import Span


class Stretch(NamedTuple):
    """A span of the timeline, as much of it as had passed when the file was read."""

    span: Span
    covered: int
    """ns."""

    @property
    def sides(self) -> tuple[int, int]:
        """Where it begins and where it ends, in ns of the run."""
        return self.span.begin_ns, self.span.begin_ns + self.covered

    @property
    def begin(self) -> str:
        """When it began, in words."""
        return instant(self.span.begin_ns)

    @property
    def mean(self) -> int:
        """The mean lateness of its activations, ns."""
        return self.span.lateness_ns // max(self.span.activations, 1)


def stretches(spans: Sequence[Span], elapsed: int) -> list[Stretch]:
    """The timeline up to the last instant that was written."""
    covered = ((span, min(span.width_ns, elapsed - span.begin_ns)) for span in spans)
    return [Stretch(span, passed) for span, passed in covered if passed > 0]


def time_scale(run: Sequence[Stretch]) -> TimeScale:
    """The time from the first span's begin to the last one's end."""
    return TimeScale(run[0].sides[0], run[-1].sides[1])
