"""Two runs side by side: what they were run under, then every figure of both, with its ratio."""

from collections.abc import Iterator, Mapping
from typing import Any

from firmware_runtime.statistics.comparison import differing_conditions
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.text.faults import faults_total
from firmware_runtime.statistics.text.summary import on_time

_DISTRIBUTION = ("p50", "p90", "p99", "p999", "max", "mean")
_COUNTERS = ("scheduled", "run", "skipped", "coalesced", "overruns", "episodes")


def difference_json(first: Statistics, second: Statistics) -> dict[str, Any]:
    """Both runs' figures, each with the second by the first; null where that is not defined."""
    found = [run.as_json() for run in (first, second)]
    figures = [dict(_figures(each)) for each in found]
    names = dict.fromkeys([*figures[0], *figures[1]])
    return {
        "conditions": {
            name: {"a": a, "b": b} for name, (a, b) in differing_conditions([first, second]).items()
        },
        "figures": {name: _compared(*(each.get(name) for each in figures)) for name in names},
    }


def difference_text(difference: Mapping[str, Any]) -> Iterator[str]:
    """Lines for what `difference_json` gives."""
    if difference["conditions"]:
        yield "not under the same conditions, so the figures do not compare as they are:"
        for name, values in difference["conditions"].items():
            yield f"  {name}: {values['a']} | {values['b']}"
    else:
        yield "under the same conditions"
    yield ""
    width = max(map(len, difference["figures"]), default=0)
    yield f"  {'':{width}} {'a':>14} {'b':>14} {'b / a':>8}"
    for name, each in difference["figures"].items():
        ratio = "-" if each["ratio"] is None else f"{each['ratio']:.3f}"
        yield f"  {name:{width}} {_number(each['a']):>14} {_number(each['b']):>14} {ratio:>8}"


def _figures(statistics: Mapping[str, Any]) -> Iterator[tuple[str, float | None]]:
    yield "elapsed_s", statistics["conditions"]["run"]["elapsed_s"]
    yield "on_time", on_time(statistics)
    for name in _COUNTERS:
        yield name, statistics[name]
    for kind in ("lateness_us", "step_us"):
        for name in _DISTRIBUTION:
            yield f"{kind}.{name}", statistics[kind][name]
    for path, missed in statistics["deadline_misses"].items():
        yield f"deadline_misses.{path}", missed
    yield "faults", faults_total(statistics)
    for path, kinds in statistics["faults"].items():
        for kind, fault in kinds.items():
            yield f"faults.{path}.{kind}", fault["count"]
    for bus, counted in statistics["bus"].items():
        for name in ("errors", "retries", "utilisation"):
            yield f"bus.{bus}.{name}", counted[name]


def _compared(first: float | None, second: float | None) -> dict[str, float | None]:
    defined = first is not None and second is not None and first != 0
    return {"a": first, "b": second, "ratio": second / first if defined else None}  # type: ignore[operator] # both are numbers where it is defined


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.6g}"
