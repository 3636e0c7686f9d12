"""What a run asked of the system and was not granted, told from its conditions."""

from collections.abc import Mapping
from typing import Any, Final

from firmware_runtime.devs.time import SECOND

NOT_ASKED: Final = "not asked for"
NOTHING_TO_WAIT_FOR: Final = "virtual time waits for nothing"


def as_they_hold(conditions: Mapping[str, Any], yielded_ns: int) -> dict[str, Any]:
    """The conditions, less the priority that the run gave up at that instant; 0: it never did."""
    settings = conditions.get("settings", {})
    fifo = settings.get("fifo_priority")
    if yielded_ns == 0 or fifo is None or not fifo["granted"]:
        return dict(conditions)
    reason = f"given up after {yielded_ns / SECOND:.1f} s: overload"
    without = {**fifo, "granted": False, "reason": reason}
    return {
        **conditions,
        "settings": {**settings, "fifo_priority": without},
        "scheduler": "SCHED_OTHER",
        "scheduler_priority": 0,
    }


def refused(conditions: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """The requests that were refused, by the setting's name: `asked`, `granted`, `reason`."""
    return {
        name: request
        for name, request in conditions.get("settings", {}).items()
        if not request["granted"] and request["reason"] not in {NOT_ASKED, NOTHING_TO_WAIT_FOR}
    }


def refusals(conditions: Mapping[str, Any]) -> list[str]:
    """A line for each request that was refused."""
    return [
        f"not granted: {name} = {request['asked']} ({request['reason']})"
        for name, request in refused(conditions).items()
    ]
