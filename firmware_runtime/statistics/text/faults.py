"""Faults of a run as a person reads them."""

from collections.abc import Iterator, Mapping
from typing import Any


def faults_total(statistics: Mapping[str, Any]) -> int:
    """How many faults all models have reported, given statistics as `as_json` gives them."""
    return sum(
        counted["count"] for kinds in statistics["faults"].values() for counted in kinds.values()
    )


def fault_lines(statistics: Mapping[str, Any]) -> Iterator[str]:
    """A line for each kind of fault of each model."""
    for path, kinds in statistics["faults"].items():
        for kind, counted in kinds.items():
            yield f"{path} {kind} {_times(counted['count'])}{_when(counted)}: {counted['last']}"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _when(counted: Mapping[str, Any]) -> str:
    """When the first and the last came, as far as that is known."""
    first, last = counted["first_s"], counted["last_s"]
    if last is None:
        return ""
    if counted["count"] == 1:
        return f" at {last:.2f} s"
    begun = "" if first is None else f" from {first:.2f} s"
    return f"{begun} to {last:.2f} s"
