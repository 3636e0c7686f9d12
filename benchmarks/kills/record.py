"""When the outputs of served doubles were on and when off, by the doubles' own log.

Instants are of CLOCK_MONOTONIC, in ns, and those of the chips: when the log is read is no matter.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Final

from firmware_runtime.devs.time import MILLISECOND

FLICKER: Final = 100 * MILLISECOND
"""Outputs that are all at zero for less are driven: a command of nothing is one."""


class OutputRecord:
    """Follows a log; `changes` are the instants at which outputs went on, and all went off."""

    def __init__(self, log: Path) -> None:
        self.changes: list[tuple[int, bool]] = []
        self._log = log
        self._served_at = 0
        self._read_up_to = 0
        self._levels: dict[str, float] = {}

    @property
    def is_on(self) -> bool:
        """Whether any output is driven, by what the log says now."""
        self._catch_up()
        return bool(self.changes) and self.changes[-1][1]

    def off_since(self, at: int, now: Callable[[], int]) -> int | None:
        """The first instant from `at` on at which all went off, or were, and stayed so for a while.

        None if there is none yet.
        """
        self._catch_up()
        for number, (instant, is_on) in enumerate(self.changes):
            later = self.changes[number + 1][0] if number + 1 < len(self.changes) else now()
            if not is_on and later - max(instant, at) >= FLICKER:
                return max(instant, at)
        return None

    def on_after(self, at: int) -> int | None:
        """The first instant after `at` at which an output went on; None if there is none yet."""
        self._catch_up()
        return next((instant for instant, is_on in self.changes if is_on and instant > at), None)

    def _catch_up(self) -> None:
        if not self._log.exists():
            return
        with self._log.open("rb") as file:
            file.seek(self._read_up_to)
            whole = file.read().rpartition(b"\n")[0]
        for line in whole.splitlines():
            self._take(json.loads(line))
        self._read_up_to += len(whole) + 1 if whole else 0

    def _take(self, line: dict[str, object]) -> None:
        if line.get("event") == "serving":
            self._served_at = int(str(line["monotonic_ns"]))
        if "output" not in line:
            return
        at = self._served_at + int(str(line["t_ns"]))
        self._levels[str(line["output"])] = float(str(line["value"]))
        is_on = any(self._levels.values())
        if self.changes and self.changes[-1][0] == at:  # several outputs, one instant
            self.changes.pop()
        if not self.changes or self.changes[-1][1] != is_on:
            self.changes.append((at, is_on))
