"""Statistics as a person reads them: one line, how it went, a table, the worst, the conditions."""

from collections.abc import Mapping
from typing import Any

from firmware_runtime.statistics.periods_kept import periods_not_kept
from firmware_runtime.statistics.refusals import refusals
from firmware_runtime.statistics.text.faults import fault_lines
from firmware_runtime.statistics.text.summary import is_virtual, summary

_WORST_SHOWN = 3
_MARGIN = "  "


def statistics_text(statistics: Mapping[str, Any], worst: int = _WORST_SHOWN) -> list[str]:
    """Lines for the statistics of one run, given as `Statistics.as_json` gives them."""
    return [
        summary(statistics),
        _story(statistics),
        *(f"  {sentence}" for sentence in periods_not_kept(statistics)),
        *_virtual(statistics),
        "",
        *_models(statistics),
        *_times(statistics),
        *_buses(statistics),
        *_deadlines(statistics),
        *(f"  fault: {line}" for line in fault_lines(statistics)),
        *_worst(statistics, worst),
        "",
        *_conditions(statistics["conditions"]),
    ]


def microseconds(us: float | None) -> str:
    """A span of time in the unit that reads best."""
    if us is None:
        return "-"
    if us >= 1e6:
        return f"{us / 1e6:.2f} s"
    if us >= 1000:
        return f"{us / 1000:.2f} ms"
    return f"{us:.1f} us"


def causes_text(causes: Mapping[str, Any], shown: int = 4) -> str:
    """What an activation spent its time on, the longest first; the wire is within the models."""
    spent = {
        "waking": causes["wake_us"],
        "steps before": causes["behind_us"],
        "garbage": causes["garbage_us"],
        **causes["models_us"],
        **{
            f"on the wire {bus} {address}": us
            for bus, devices in causes["bus_us"].items()
            for address, us in devices.items()
        },
    }
    longest = sorted(spent.items(), key=lambda each: -each[1])[:shown]
    text = ", ".join(f"{name} {microseconds(us)}" for name, us in longest if us > 0)
    return text or "nothing measurable"


def _story(statistics: Mapping[str, Any]) -> str:
    """How far it has come, or how it ended, in whole numbers."""
    run = statistics["conditions"]["run"]
    state = "has run for" if run["state"] == "running" else f"{_ended(run)} after"
    return (
        f"{state} {run['elapsed_s']:.2f} s: {statistics['run']} of "
        f"{statistics['scheduled']} activations run, {statistics['skipped']} skipped, "
        f"{statistics['coalesced']} coalesced{_waiting(statistics)}{_overruns(statistics)}"
    )


def _overruns(statistics: Mapping[str, Any]) -> str:
    """How often it was late, where something can be."""
    if is_virtual(statistics):
        return ""
    overruns = _counted(statistics["overruns"], "overrun")
    return f"; {overruns} in {_counted(statistics['episodes'], 'episode')}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _waiting(statistics: Mapping[str, Any]) -> str:
    """What is due and has not had its turn yet, where there is such a thing."""
    waiting = sum(model["waiting"] for model in statistics["models"].values())
    return f", {waiting} waiting" if waiting > 0 else ""


def _virtual(statistics: Mapping[str, Any]) -> list[str]:
    if not is_virtual(statistics):
        return []
    return [
        "  in virtual time, in which nothing is late and nothing takes time: there are counts only"
    ]


def _ended(run: Mapping[str, Any]) -> str:
    """How the run ended, with the reason unless that is only that its time was up."""
    if run["reason"] is None or run["state"] == "ended":
        return str(run["state"])
    return f"{run['state']} ({run['reason']})"


def _models(statistics: Mapping[str, Any]) -> list[str]:
    if not statistics["models"]:
        return []
    if is_virtual(statistics):
        head: tuple[str, ...] = ("activations of", "rate", "run", "skipped")
        rows = [
            (path, rate_text(model), str(model["run"]), str(model["skipped"]))
            for path, model in statistics["models"].items()
        ]
        return _aligned([head, *rows])
    head = ("lateness of", "rate", "run", "p50", "p99", "max", "budget", "load", "late", "skipped")
    rows = [(path, *_model(model)) for path, model in statistics["models"].items()]
    return [*_aligned([(*head, "last"), *rows]), ""]


def rate_text(model: Mapping[str, Any]) -> str:
    """How often a model is due; one without a period has events."""
    return "events" if model["period_us"] is None else f"{1e6 / model['period_us']:g} Hz"


def _model(model: Mapping[str, Any]) -> tuple[str, ...]:
    late, last = model["lateness_us"], model["last_late_t_ns"]
    return (
        rate_text(model),
        str(model["run"]),
        *(microseconds(late[key]) for key in ("p50", "p99", "max")),
        microseconds(model["tolerance_us"]),
        _percent(model["load"]),
        str(model["overruns"]),
        str(model["skipped"]),
        "-" if last is None else f"at {last / 1e9:.2f} s",
    )


def _times(statistics: Mapping[str, Any]) -> list[str]:
    if is_virtual(statistics):
        return []
    keys = ("p50", "p90", "p99", "p999", "max")
    rows: list[tuple[str, ...]] = [("time of", "p50", "p90", "p99", "p99.9", "max")]
    for path, model in statistics["models"].items():
        rows.append((path, *(microseconds(model["step_us"][key]) for key in keys)))
    rows.append(("whole step", *(microseconds(statistics["step_us"][key]) for key in keys)))
    return _aligned(rows)


def _aligned(rows: list[tuple[str, ...]]) -> list[str]:
    """Rows of a table: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        _MARGIN
        + "  ".join(
            [row[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        ).rstrip()
        for row in rows
    ]


def _buses(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"  bus {name}: {bus['transactions']} transactions, {bus['bytes']} bytes, "
        f"{bus['errors']} errors, {bus['retries']} retries, {_percent(bus['utilisation'])} busy"
        for name, bus in statistics["bus"].items()
    ]


def _deadlines(statistics: Mapping[str, Any]) -> list[str]:
    return [
        f"  deadline {path}: {deadline_text(counted)}"
        for path, counted in statistics["deadlines"].items()
    ]


def deadline_text(counted: Mapping[str, int]) -> str:
    """What became of the samples on a path; of one that is not enabled nothing was measured."""
    if counted["answers"] == 0:
        return f"not enabled, none of {counted['samples']} samples has been answered"
    return f"{counted['misses']} missed"


def _worst(statistics: Mapping[str, Any], shown: int) -> list[str]:
    return [
        f"  worst: {worst['model']} at {worst['t_ns'] / 1e9:.3f} s, "
        f"{microseconds(worst['lateness_us'])} late, step {microseconds(worst['step_us'])}: "
        f"{causes_text(worst['causes'])}"
        for worst in statistics["worst"][:shown]
    ]


def _conditions(conditions: Mapping[str, Any]) -> list[str]:
    where = (conditions.get(name) for name in ("machine", "kernel", "python"))
    scheduler, priority = conditions.get("scheduler"), conditions.get("scheduler_priority")
    lines = [f"  on {', '.join(map(str, where))}, {scheduler} {priority or ''}".rstrip()]
    overloaded_s = conditions["run"]["overloaded_s"]
    if overloaded_s is not None:
        lines.append(f"  overloaded: after {overloaded_s:.1f} s the loop had no time left")
    return lines + [f"  {refusal}" for refusal in refusals(conditions)]


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.1%}"
