"""What speaks against arming: devices that do not answer, a loop that does not keep its time."""

from typing import Protocol, runtime_checkable

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.loop import Executive
from firmware_runtime.service.arming import Objection
from firmware_runtime.telemetry.layout import MODEL
from firmware_runtime.telemetry.statistics import Statistics

QUIET = 5 * SECOND
"""How long the last overrun must be ago, ns."""
LEAST_RATE = 0.95
"""Share of the activations due in the last second that must have run."""
_OVERRUNS, _LAST_LATE = MODEL.index("overruns"), MODEL.index("last_late_ns")


@runtime_checkable
class Device(Protocol):
    """A model of hardware that can say whether it works."""

    path: str

    def unready(self) -> str | None:
        """Why it does not work, in a few words; None if it does."""


def objections_to(executive: Executive) -> tuple[Objection, ...]:
    """All there are to arming this run."""
    return (
        lambda _now: _fifo(executive.statistics),
        lambda _now: _devices(executive),
        lambda now: _rate(executive.statistics, now),
        lambda now: _overrun(executive.statistics, now),
    )


def _fifo(statistics: Statistics) -> str | None:
    request = statistics.header["conditions"]["settings"].get("fifo_priority")
    if request is None or request["asked"] == 0 or request["granted"]:
        return None
    return f"SCHED_FIFO {request['asked']} was asked for and not granted ({request['reason']})"


def _devices(executive: Executive) -> str | None:
    faults = [
        f"{atomic.path} {why}"
        for atomic in executive.simulator.atomics
        if isinstance(atomic, Device) and (why := atomic.unready()) is not None
    ]
    return "; ".join(faults) or None


def _rate(statistics: Statistics, now: int) -> str | None:
    """What became of the activations due in the last whole second."""
    periods = [stated["period_ns"] for stated in statistics.header["models"].values()]
    if not periods:
        return None
    whole = [
        span for span in statistics.timeline if now - 3 * SECOND < span.begin_ns <= now - SECOND
    ]
    if not whole:
        return "the rate has not been measured for a second yet"
    due = sum(SECOND / period for period in periods)
    rate = whole[-1].activations / due
    if rate >= LEAST_RATE:
        return None
    return f"{rate:.0%} of the activations due ran in the last second; expected {LEAST_RATE:.0%}"


def _overrun(statistics: Statistics, now: int) -> str | None:
    for index, path in enumerate(statistics.layout.models):
        first = statistics.layout.model(index)
        last_late = statistics.cells[first + _LAST_LATE]
        if statistics.cells[first + _OVERRUNS] > 0 and now - last_late < QUIET:
            ago = (now - last_late) / SECOND
            return f"{path} had an overrun {ago:.1f} s ago; expected none for 5 s"
    return None
