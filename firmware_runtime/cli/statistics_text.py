"""Statistics as a person reads them: a line to begin with, then a table, then the worst."""

from collections.abc import Mapping
from typing import Any

_WORST_SHOWN = 3
_NOTHING_REFUSED = {"not asked for", "virtual time waits for nothing"}


def statistics_text(statistics: Mapping[str, Any]) -> list[str]:
    """Lines for the statistics of one run, given as `Statistics.as_json` gives them."""
    return [
        summary(statistics),
        "",
        *_table(statistics),
        *_buses(statistics),
        *_deadlines(statistics),
        *_worst(statistics),
        "",
        *_conditions(statistics["conditions"]),
    ]


def summary(statistics: Mapping[str, Any]) -> str:
    """The one line that says whether the run kept its time."""
    run = statistics["conditions"]["run"]
    late = statistics["lateness_us"]
    return (
        f"{_ended(run)} after {run['elapsed_s']:.2f} s: {statistics['run']} of "
        f"{statistics['scheduled']} activations run, {statistics['skipped']} skipped, "
        f"{statistics['coalesced']} coalesced; {statistics['overruns']} overruns in "
        f"{statistics['episodes']} episodes; lateness p50 {_us(late['p50'])}, "
        f"p99 {_us(late['p99'])}, max {_us(late['max'])}"
    )


def _ended(run: Mapping[str, Any]) -> str:
    """How the run ended, with the reason unless that is only that its time was up."""
    if run["reason"] is None or run["state"] == "ended":
        return str(run["state"])
    return f"{run['state']} ({run['reason']})"


def _table(statistics: Mapping[str, Any]) -> list[str]:
    models = statistics["models"].items()
    rows: list[tuple[str, ...]] = [("", "p50", "p90", "p99", "p99.9", "max")]
    rows += [(f"{path} lateness", *_row(model["lateness_us"])) for path, model in models]
    rows += [(f"{path} own time", *_row(model["step_us"])) for path, model in models]
    rows.append(("whole step", *_row(statistics["step_us"])))
    width = max(len(row[0]) for row in rows)
    return [
        f"  {name:{width}} " + " ".join(f"{cell:>9}" for cell in cells) for name, *cells in rows
    ]


def _row(histogram: Mapping[str, float | None]) -> tuple[str, ...]:
    return tuple(_us(histogram[key]) for key in ("p50", "p90", "p99", "p999", "max"))


def _buses(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"  bus {name}: {bus['transactions']} transactions, {bus['bytes']} bytes, "
        f"{bus['errors']} errors, {bus['retries']} retries, {_percent(bus['utilisation'])} busy"
        for name, bus in statistics["bus"].items()
    ]


def _deadlines(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"  deadline {path}: {missed} missed"
        for path, missed in statistics["deadline_misses"].items()
    ]


def _worst(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"  worst: {worst['model']} at {worst['t_ns'] / 1e9:.3f} s, {_us(worst['lateness_us'])} "
        f"late, step {_us(worst['step_us'])}: {_causes(worst['causes'])}"
        for worst in statistics["worst"][:_WORST_SHOWN]
    ]


def _causes(causes: Mapping[str, Any]) -> str:
    spent = {
        "waking": causes["wake_us"],
        "steps before": causes["behind_us"],
        "garbage": causes["garbage_us"],
        **causes["models_us"],
    }
    longest = sorted(spent.items(), key=lambda each: -each[1])[:3]
    return ", ".join(f"{name} {_us(us)}" for name, us in longest if us > 0) or "nothing measurable"


def _conditions(conditions: Mapping[str, Any]) -> list[str]:
    lines = [
        f"  on {conditions['machine']}, {conditions['kernel']}, {conditions['python']}, "
        f"{conditions['scheduler']} {conditions['scheduler_priority'] or ''}".rstrip()
    ]
    lines += [
        f"  not granted: {name} = {request['asked']} ({request['reason']})"
        for name, request in conditions.get("settings", {}).items()
        if not request["granted"] and request["reason"] not in _NOTHING_REFUSED
    ]
    return lines


def _us(microseconds: float | None) -> str:
    """A span of time in the unit that reads best."""
    if microseconds is None:
        return "-"
    if microseconds >= 1e6:
        return f"{microseconds / 1e6:.2f} s"
    if microseconds >= 1000:
        return f"{microseconds / 1000:.2f} ms"
    return f"{microseconds:.1f} us"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.1%}"
