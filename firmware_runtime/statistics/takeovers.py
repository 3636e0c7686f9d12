"""Takeovers by a guard, in a file beside the run's statistics: JSON lines, the last hundred.

    {"at_ns": 81234567890, "writer": {...}, "generation": 1,
     "why": "process 4711 has ended", "off_after_ns": 1200000, "failed": []}

`at_ns` is CLOCK_MONOTONIC when the guard took over. `writer` is the process it took the outputs
from, as in the header of the statistics; `generation` counts this guard's takeovers of that run.
`off_after_ns` counts from `at_ns` until every chip had acknowledged full-off; it is null as long as
`failed` says what did not.
"""

from pathlib import Path

import msgspec

from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, read_file, replace_file
from firmware_runtime.system.this_process import ProcessIdentity

KEPT = 100


class Takeover(msgspec.Struct):
    """One takeover of a run's outputs."""

    at_ns: int
    writer: ProcessIdentity
    number: int = msgspec.field(name="generation")
    why: str
    off_after_ns: int | None = None
    failed: list[str] = []

    def text(self) -> str:
        """The takeover in a sentence."""
        if self.off_after_ns is None:
            return f"{self.why}; outputs not off: {'; '.join(self.failed)}"
        return f"{self.why}; all outputs off after {self.off_after_ns / 1e6:.1f} ms"


def note_takeover(statistics: Path, takeover: Takeover) -> None:
    """Add one, or replace what was noted of it before; the file is whole at any instant.

    What guards before this one have noted stays, and what another one notes beside it. A file in
    another format is replaced.
    """
    noted = {each.at_ns: each for each in read_takeovers(statistics)}
    noted[takeover.at_ns] = takeover
    lines = [msgspec.json.encode(each) + b"\n" for each in noted.values()]
    replace_file(Companion.TAKEOVERS.beside(statistics), b"".join(lines[-KEPT:]), OWN_AND_GROUP)


def read_takeovers(statistics: Path) -> list[Takeover]:
    """Those that are kept, oldest first; none where there is no such file."""
    try:
        lines = read_file(Companion.TAKEOVERS.beside(statistics)).splitlines()
        return [msgspec.json.decode(line, type=Takeover) for line in lines]
    except (OSError, ValueError, RecursionError):  # msgspec's errors are ValueErrors
        return []


def takeovers_of(statistics: Path, writer: ProcessIdentity) -> list[Takeover]:
    """Those that took the outputs from this process."""
    return [each for each in read_takeovers(statistics) if each.writer == writer]
