"""The one line that says how a run does: for `stats`, `top`, `systemctl status` and the journal."""

from collections.abc import Mapping
from typing import Any

from firmware_runtime.statistics.periods_kept import not_keeping
from firmware_runtime.statistics.text.faults import faults_total

_CLASSES = {"SCHED_FIFO": "FIFO", "SCHED_RR": "RR", "SCHED_OTHER": "OTHER"}
_TENS = 10.0


def summary(statistics: Mapping[str, Any]) -> str:
    """Statistics as `Statistics.as_json` gives them, in one line.

    `100 Hz 99.98 % late 3 skip 2/360000 p99 0.18 ms max 2.4 ms i2c1 11 % FIFO60
    governor=performance armed`: the rate of the fastest periodic model, or how many events there
    have been where there is none, the share of activations
    that ran on time, overruns, skipped of scheduled, lateness, buses, conditions, state. Before the
    buses `faults 7`, if models reported any; before the state `overloaded`, if it has been.
    """
    parts = [*_activations(statistics), *_periods(statistics), *_faults(statistics)]
    parts += _buses(statistics)
    parts += _conditions(statistics["conditions"])
    return " ".join([*parts, _state(statistics["conditions"]["run"])])


def milliseconds(microseconds: float | None) -> str:
    """A time to two digits, such as `0.18 ms`; `-` where there is none."""
    if microseconds is None:
        return "-"
    value = microseconds / 1000
    return f"{value:.2g} ms" if value < _TENS else f"{value:.0f} ms"


def on_time(statistics: Mapping[str, Any]) -> float | None:
    """Share of the scheduled activations that ran without an overrun; None before the first."""
    if statistics["scheduled"] == 0:
        return None
    share: float = (statistics["run"] - statistics["overruns"]) / statistics["scheduled"]
    return share


def rate_hz(statistics: Mapping[str, Any]) -> float | None:
    """The rate of the fastest periodic model, None if there is no such model."""
    periods = [model["period_us"] for model in statistics["models"].values()]
    return 1e6 / min(filter(None, periods)) if any(periods) else None


def _activations(statistics: Mapping[str, Any]) -> list[str]:
    rate, share = rate_hz(statistics), on_time(statistics)
    first = f"{statistics['scheduled']} events" if rate is None else f"{rate:g} Hz"
    skipped = f"skip {statistics['skipped']}/{statistics['scheduled']}"
    if is_virtual(statistics):
        return [first, "virtual time", skipped]
    late = statistics["lateness_us"]
    return [
        first,
        "- %" if share is None else f"{int(share * 10000) / 100:.2f} %",  # 100 only if all were
        f"late {statistics['overruns']}",
        skipped,
        f"p99 {milliseconds(late['p99'])} max {milliseconds(late['max'])}",
    ]


def is_virtual(statistics: Mapping[str, Any]) -> bool:
    """Whether the run was in virtual time, in which nothing can be late."""
    return bool(statistics["conditions"].get("clock") == "VirtualClock")


def _periods(statistics: Mapping[str, Any]) -> list[str]:
    return [f"period not kept by {path}" for path in not_keeping(statistics)]


def _faults(statistics: Mapping[str, Any]) -> list[str]:
    total = faults_total(statistics)
    return [f"faults {total}"] if total > 0 else []


def _buses(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"{name} -" if bus["utilisation"] is None else f"{name} {bus['utilisation'] * 100:.0f} %"
        for name, bus in statistics["bus"].items()
    ]


def _conditions(conditions: Mapping[str, Any]) -> list[str]:
    scheduler = str(conditions.get("scheduler", "unknown"))
    priority = conditions.get("scheduler_priority") or ""
    return [
        f"{_CLASSES.get(scheduler, scheduler)}{priority}",
        f"governor={conditions.get('governor') or 'unknown'}",
    ]


def _state(run: Mapping[str, Any]) -> str:
    if run["state"] != "running":
        return str(run["state"])
    state = "armed" if run["armed"] else "disarmed"
    return state if run["overloaded_s"] is None else f"overloaded {state}"
