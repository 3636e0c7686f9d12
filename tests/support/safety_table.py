"""The table of the exit matrix: written where FIRMWARE_RUNTIME_SAFETY_TABLE says, if it does."""

import json
import os
from pathlib import Path


class SafetyTable:
    """Ways to die and the time until all outputs were off."""

    def __init__(self) -> None:
        self._rows: list[dict[str, object]] = []

    def add(self, way: str, took_ms: float, goal_ms: float) -> None:
        """One measurement."""
        self._rows.append({"way": way, "took_ms": round(took_ms, 1), "goal_ms": goal_ms})

    def keep(self) -> None:
        """Write what was measured, if somebody asked for it."""
        if path := os.environ.get("FIRMWARE_RUNTIME_SAFETY_TABLE"):
            Path(path).write_text(json.dumps(self._rows, indent=1) + "\n")
