"""A run's status in one line: for `stats`, `top`, `systemctl status` and the journal."""

from collections.abc import Iterator

from firmware_runtime.statistics.figures import FaultFigures, Figures
from firmware_runtime.statistics.file_header import Conditions, RunFigures, Settings
from firmware_runtime.statistics.number_formats import hertz, milliseconds, seconds

_CLASSES = {"SCHED_FIFO": "FIFO", "SCHED_RR": "RR", "SCHED_OTHER": "OTHER"}


def summary(figures: Figures) -> str:
    """The figures of a run in one line.

    `100 Hz 99.98 % on time, late 3 skip 2/360000 p99 0.18 ms max 2.4 ms i2c1 11 % FIFO60
    governor=performance armed`: the rate of the fastest periodic model, or how many events there
    have been where there is none, the share of activations
    that ran on time, overruns, skipped of scheduled, lateness, buses, conditions, state. Before the
    buses `faults 7`, if models reported any; before the state `overloaded`, if it has been.
    """
    parts = _activations(figures)
    parts += [f"period not kept by {path}" for path in figures.not_keeping_period]
    if figures.faults_total > 0:
        parts.append(f"faults {figures.faults_total}")
    parts += _buses(figures)
    parts += _conditions(figures.conditions)
    return " ".join([*parts, _state(figures.conditions.run)])


def _activations(figures: Figures) -> list[str]:
    rate, share = figures.rate_hz, figures.on_time
    first = f"{figures.scheduled} events" if rate is None else hertz(rate)
    skipped = f"skip {figures.skipped}/{figures.scheduled}"
    if figures.is_virtual:
        return [first, "virtual time", skipped]
    late = figures.lateness_us
    return [
        first,
        f"{_percent(share)} on time,",
        f"late {figures.overruns}",
        skipped,
        f"p99 {milliseconds(late.p99)} max {milliseconds(late.max)}",
    ]


def _percent(share: float | None) -> str:
    return "- %" if share is None else f"{int(share * 10000) / 100:.2f} %"  # 100 only if all were


def _buses(figures: Figures) -> list[str]:
    return [
        f"{name} -" if bus.utilisation is None else f"{name} {bus.utilisation * 100:.0f} %"
        for name, bus in figures.bus.items()
    ]


def _conditions(conditions: Conditions) -> list[str]:
    scheduler = conditions.text("scheduler") or "unknown"
    priority = conditions.stated.get("scheduler_priority") or ""
    return [
        f"{_CLASSES.get(scheduler, scheduler)}{priority}",
        f"governor={conditions.text('governor') or 'unknown'}",
    ]


def _state(run: RunFigures) -> str:
    if run.state != "running":
        return run.state
    state = "armed" if run.armed else "disarmed"
    return state if run.overloaded_s is None else f"overloaded {state}"


def fault_lines(figures: Figures) -> Iterator[str]:
    """A line for each kind of fault of each model."""
    for path, kinds in figures.faults.items():
        for kind, counted in kinds.items():
            yield f"{path} {kind} {_times(counted.count)}{_when(counted)}: {counted.last}"


def periods_not_kept(figures: Figures) -> Iterator[str]:
    """A sentence on each model that does not come back at the period that it states."""
    for path in figures.not_keeping_period:
        model = figures.models[path]
        yield (
            f"{path} states a period of {(model.period_us or 0) / 1000:g} ms and does not keep it: "
            f"{model.irregular} of {model.run} activations came at another time, the last "
            f"{(model.returned_after_us or 0) / 1000:g} ms after the one before"
        )


def refusals(settings: Settings) -> Iterator[str]:
    """A line for each request that was refused."""
    for name, request in settings.items():
        if request.is_refused:
            yield f"not granted: {name} = {request.asked} ({request.reason})"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _when(counted: FaultFigures) -> str:
    """Return when the first and the last came, as far as that is known."""
    first, last = counted.first_s, counted.last_s
    if last is None:
        return ""
    if counted.count == 1:
        return f" at {seconds(last)}"
    begun = "" if first is None else f" from {seconds(first)}"
    return f"{begun} to {seconds(last)}"
