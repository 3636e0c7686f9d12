"""A run's status in one line: for `stats`, `top`, `systemctl status` and the journal."""

from firmware_runtime.statistics.conditions import Conditions, RunFigures
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.number_formats import hertz, milliseconds

_CLASSES = {"SCHED_FIFO": "FIFO", "SCHED_RR": "RR", "SCHED_OTHER": "OTHER"}


def summary(figures: Figures) -> str:
    """The figures of a run in one line.

    `100 Hz 99.98 % late 3 skip 2/360000 p99 0.18 ms max 2.4 ms i2c1 11 % FIFO60
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
        "- %" if share is None else f"{int(share * 10000) / 100:.2f} %",  # 100 only if all were
        f"late {figures.overruns}",
        skipped,
        f"p99 {milliseconds(late.p99)} max {milliseconds(late.max)}",
    ]


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
