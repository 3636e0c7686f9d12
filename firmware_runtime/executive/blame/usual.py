"""What a run's counters grow by while nothing is late: taken from the last second that was quiet.

A counter grows in every step, so what it grew by since a reading says nothing yet. What is usual
for so many steps is taken off first, and no counter falls below zero by that.
"""

from typing import NamedTuple

from msgspec import structs

from firmware_runtime.system.thread_counters import Counted, Reading, between

LEAST_STEPS = 5
"""A quiet time with fewer says little; it is used only while there is no other."""
_KEPT = {"from_cpu", "to_cpu", "was_moved", "khz_before", "khz", "continued", "throttled_ns"}
"""Fields that do not grow with the steps: states, and what no run has in the usual way."""


class Mark(NamedTuple):
    """A reading, and how much the run itself had counted by then."""

    reading: Reading
    steps: int
    retries: int
    busy_ns: int


class Grown(NamedTuple):
    """What was counted between two marks."""

    counted: Counted
    steps: int
    retries: int
    busy_ns: int


def grown(before: Mark, after: Mark) -> Grown:
    """From one mark to the next."""
    return Grown(
        between(before.reading, after.reading),
        after.steps - before.steps,
        after.retries - before.retries,
        after.busy_ns - before.busy_ns,
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
    return Grown(
        structs.replace(found.counted, **counted),
        found.steps,
        _beyond(found.retries, quiet.retries, found.steps, quiet.steps) or 0,
        _beyond(found.busy_ns, quiet.busy_ns, found.steps, quiet.steps) or 0,
    )


def _beyond(found: int | None, quiet: int | None, steps: int, quiet_steps: int) -> int | None:
    if found is None:
        return None
    return max(found - (quiet or 0) * steps // quiet_steps, 0)
