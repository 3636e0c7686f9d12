"""What these benches' figures were measured on: what a run notes of the system, and its CPU."""

from collections.abc import Mapping
from typing import Any

from benchmarks.shared import side_by_side
from firmware_runtime.system.conditions import system_conditions


def conditions() -> dict[str, Any]:
    """The conditions, as a report keeps them."""
    machine = side_by_side.conditions()
    return {**system_conditions(), "cpu": machine["cpu"], "load": machine["load"]}


def conditions_text(found: Mapping[str, Any]) -> str:
    """The conditions in one line."""
    where = "a virtual machine" if found["virtualised"] else "no virtual machine seen"
    return (
        "{python} on {kernel} {machine}, {cpu}, {cpu_count} CPUs, {where}, "
        "clock {clock_source}, governor {governor}, load {load}"
    ).format(where=where, **found)
