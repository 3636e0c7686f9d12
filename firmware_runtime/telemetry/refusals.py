"""What a run asked of the system and was not granted, told from its conditions."""

from collections.abc import Mapping
from typing import Any, Final

NOT_ASKED: Final = "not asked for"
NOTHING_TO_WAIT_FOR: Final = "virtual time waits for nothing"


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
