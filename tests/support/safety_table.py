"""The table of the exit matrix in docs/safety.md: written by the tests, where they are asked to.

FIRMWARE_RUNTIME_SAFETY_TABLE=docs/safety.md .venv/bin/python -m pytest tests/safety
"""

import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

DOCUMENT = Path(__file__).parents[2] / "docs" / "safety.md"
BEGIN, END = "<!-- exit matrix: written by tests/safety -->", "<!-- end of the exit matrix -->"
_HEAD = (
    "| what happens to the run | outputs off after, ms | goal, ms |",
    "|---|---|---|",
)


class Row(NamedTuple):
    """A way to die, and the time until all outputs were off."""

    way: str
    took_ms: float
    goal_ms: float

    def __str__(self) -> str:
        return f"| {self.way} | {self.took_ms:.1f} | {self.goal_ms:g} |"


class SafetyTable:
    """What was measured in one run of the tests."""

    def __init__(self) -> None:
        self._rows: list[Row] = []

    def add(self, way: str, took_ms: float, goal_ms: float) -> None:
        """One measurement."""
        self._rows.append(Row(way, took_ms, goal_ms))

    def keep(self) -> None:
        """Write the table into the document that is named, if one is; it must have every way."""
        if path := os.environ.get("FIRMWARE_RUNTIME_SAFETY_TABLE"):
            written_between(BEGIN, END, Path(path), [machine(), "", *_HEAD, *map(str, self._rows)])
        written = DOCUMENT.read_text()
        missing = [row.way for row in self._rows if f"| {row.way} |" not in written]
        assert not missing, f"{DOCUMENT} has no row of {missing}; write it as this module says"


def machine() -> str:
    """What the times were measured on."""
    return (
        f"Measured with {os.cpu_count()} cores, Linux {platform.release().split('-')[0]}, "
        f"{platform.machine()}, {platform.python_implementation()} {platform.python_version()}."
    )


def written_between(begin: str, end: str, document: Path, lines: Sequence[str]) -> None:
    """Put these lines between two marks of a document, instead of what stands there."""
    before, _, rest = document.read_text().partition(begin)
    text = "\n".join([begin, *lines, end])
    document.write_text(before + text + rest.partition(end)[2])
