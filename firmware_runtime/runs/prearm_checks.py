"""Pre-arm checks: scheduling granted, devices ready, the loop at its rate and not too late."""

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Device
from firmware_runtime.runs.arming import PrearmCheck

JUDGED = 5 * SECOND
"""How far back lateness is judged, ns."""
LEAST_RATE = 0.95
"""Share of the activations due in the last second that must have been worked off."""
UNJUDGED = 100.0
"""Of activations that may be late, per cent: timing does not matter at all."""


def prearm_checks(executive: Executive, max_late_percent: float) -> tuple[PrearmCheck, ...]:
    """Return all checks of this run, but the guard's (`arming`)."""
    return (
        lambda _now: _fifo(executive),
        lambda _now: _devices(executive),
        lambda now: _rate(executive, now),
        lambda now: _lateness(executive, now, max_late_percent),
    )


def _fifo(executive: Executive) -> str | None:
    request = executive.granted.get("fifo_priority")
    if request is None or request.asked == 0 or request.granted:
        return None
    return f"SCHED_FIFO {request.asked} was requested and not granted ({request.reason})"


def _devices(executive: Executive) -> str | None:
    faults = [
        f"{atomic.path} {why}"
        for atomic in executive.simulator.atomics
        if isinstance(atomic, Device) and (why := atomic.unready()) is not None
    ]
    return "; ".join(faults) or None


def _rate(executive: Executive, now: int) -> str | None:
    """Return why the loop does not work off what is due, be it that it skips some."""
    periods = _periods(executive)
    if not periods:
        return None
    if now < SECOND:
        return "the rate has not been measured for a second yet"
    lately = executive.lately(now - SECOND)
    due = sum(max((now - lately.begin_ns) // period - 1, 0) for period in periods)
    done = lately.activations + lately.skipped
    if done >= LEAST_RATE * due:
        return None
    return f"{done / due:.0%} of the activations due lately came; expected {LEAST_RATE:.0%}"


def _lateness(executive: Executive, now: int, max_late_percent: float) -> str | None:
    """Return why activations were too late: too many, or one by more than a period."""
    lately = executive.lately(now - JUDGED)
    late_percent = (
        100 * (lately.late + lately.skipped) / max(lately.activations + lately.skipped, 1)
    )
    period = min(_periods(executive), default=NEVER)
    is_fit = late_percent <= max_late_percent and lately.lateness_max_ns <= period
    if is_fit or max_late_percent == UNJUDGED:
        return None
    latest = "" if period == NEVER else _none_later_than(period)
    return (
        f"{late_percent:.2f} % of the activations of the last {JUDGED // SECOND} s were late or "
        f"skipped, the latest came {lately.lateness_max_ns / MILLISECOND:.1f} ms late; expected at "
        f"most {max_late_percent:g} %{latest}"
    )


def _none_later_than(period: int) -> str:
    return f", and none later than a period ({period / MILLISECOND:g} ms)"


def _periods(executive: Executive) -> list[int]:
    """Return the periods of the models that have one, ns."""
    return [account.period for account in executive.accounts if account.period != NEVER]
