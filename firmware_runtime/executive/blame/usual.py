"""What a run's counters grow by while nothing is late: taken from the last second that was quiet.

A counter grows in every step, so what it grew by since a reading says nothing yet. What is usual
for so many steps is taken off first, and no counter falls below zero by that. A second in which
steps were slow, and yet on time, is not what is usual as long as there is a quieter one.
"""

from typing import NamedTuple

from msgspec import structs

from firmware_runtime.system.thread_counters import Counted, Reading, between

LEAST_STEPS = 5
"""A quiet time with fewer says little; it is used only while there is no other."""
LONGER = 2
"""A quiet time with so many times the steps says more, also if a few of them were slow."""
OLD_STEPS = 10_000
"""After so many a quiet time is no longer kept for a less quiet one."""
WAKE_NS = 50_000
"""What it takes at most to wake up on a processor that is free; a good part of it on a virtual
machine, whose processor sleeps, too."""
_STATES = {"from_cpu", "to_cpu", "was_moved", "was_regrouped", "khz_before", "khz"}
_KEPT = _STATES | {"continued", "throttled_ns", "throttlings", "disks_ns", "other_threads_ns"}
"""Fields that do not grow with the steps: states, what no run has in the usual way, and what others
do with the disks and other threads compute, which is a bound and no evidence."""


class Mark(NamedTuple):
    """A reading, and how much the run itself had counted by then."""

    reading: Reading
    steps: int
    retries: int


class Quiet(NamedTuple):
    """A time in which nothing was late; `slow_ns` is what its slow steps took beyond the usual."""

    before: Mark
    after: Mark
    slow_ns: int

    @property
    def steps(self) -> int:
        """How many there were."""
        return self.after.steps - self.before.steps

    def is_to_replace(self, other: "Quiet | None") -> bool:
        """Whether it says better what is usual: as quiet as the other, much longer, or newer."""
        if other is None:
            return True
        is_as_quiet = self.slow_ns * other.steps <= other.slow_ns * self.steps
        is_longer = self.steps >= LONGER * other.steps
        is_old = self.before.steps - other.after.steps >= OLD_STEPS
        return self.steps >= LEAST_STEPS and (is_as_quiet or is_longer or is_old)


class Grown(NamedTuple):
    """What was counted between two marks."""

    counted: Counted
    steps: int
    retries: int


def grown(before: Mark, after: Mark) -> Grown:
    """From one mark to the next."""
    return Grown(
        between(before.reading, after.reading),
        after.steps - before.steps,
        after.retries - before.retries,
    )


def beyond_usual(found: Grown, quiet: Grown | None) -> Grown:
    """What was counted beyond what a quiet time has for so many steps."""
    if quiet is None or quiet.steps == 0:
        return found
    counted = {
        name: _beyond(
            getattr(found.counted, name), getattr(quiet.counted, name), found.steps, quiet.steps
        )
        for name in found.counted.__struct_fields__
        if name not in _KEPT
    }
    more = {"run_delay_ns": _without_wakes(counted["run_delay_ns"], counted["voluntary"], quiet)}
    return Grown(
        structs.replace(found.counted, **{**counted, **more}),
        found.steps,
        _beyond(found.retries, quiet.retries, found.steps, quiet.steps) or 0,
    )


def _beyond(found: int | None, quiet: int | None, steps: int, quiet_steps: int) -> int | None:
    if found is None:
        return None
    return max(found - (quiet or 0) * steps // quiet_steps, 0)


def _without_wakes(run_delay: int | None, wakes: int | None, quiet: Grown) -> int | None:
    """Less what it takes to wake up, as often as that came beyond the usual.

    It is a part of what the thread was asleep for, such as the pages that a disk fetches.
    """
    if run_delay is None or not wakes or not quiet.counted.voluntary:
        return run_delay
    one = min((quiet.counted.run_delay_ns or 0) // quiet.counted.voluntary, WAKE_NS)
    return max(run_delay - wakes * one, 0)
