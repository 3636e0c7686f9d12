"""Many trials of what befalls a run: when all outputs were off, and whether they stayed so.

The table in docs/safety.md is written by the tests, where they are asked to; it takes an hour:

    export FIRMWARE_RUNTIME_SAFETY_TRIALS=docs/safety.md
    .venv/bin/python -m pytest tests/safety/test_trials.py
"""

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from statistics import median
from time import monotonic_ns
from typing import NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.control import ask
from tests.support.guarded_run import GuardedRun
from tests.support.safety_table import DOCUMENT, machine, written_between
from tests.support.waiting import wait_until

ASKED = os.environ.get("FIRMWARE_RUNTIME_SAFETY_TRIALS", "")
COUNT = 100 if ASKED else 2
STAYS_OFF = SECOND
BEGIN, END = "<!-- trials: written by tests/safety -->", "<!-- end of the trials -->"
_HEAD = (
    "| what happens | trials | median, ms | worst, ms | goal, ms | within it | off for 1 s after |",
    "|---|---|---|---|---|---|---|",
)

PATIENT = ("--set", "thrust_pairs.timeout_s=1")
"""TachoBot's own stop, where its loop is late by 50 ms, must not be taken for what is tried."""


class Trial(NamedTuple):
    """One trial: how long it took, and whether nothing came on again for a second."""

    took_ms: float
    stayed_off: bool


class Trials:
    """What was tried in one run of the tests, by what happened."""

    def __init__(self) -> None:
        self._rows: dict[str, tuple[float, list[Trial]]] = {}

    def of(self, what: str, goal_ms: float) -> Iterator[Callable[[GuardedRun, int], None]]:
        """As many as are asked for; each is to be called with the instant of the event."""
        trials: list[Trial] = []
        self._rows[what] = goal_ms, trials
        for _ in range(COUNT):
            yield lambda run, at: trials.append(_watched(run, at))
        assert len(trials) == COUNT
        assert all(each.stayed_off for each in trials), trials

    def keep(self) -> None:
        """Write the table into the document, if that is wanted; it must have every row.

        Rows of what was not tried this time stay as they are.
        """
        if ASKED:
            rows = _rows_of(Path(ASKED)) | {
                what: _row(what, *trials) for what, trials in self._rows.items()
            }
            ordered = [rows[what] for what in sorted(rows)]
            written_between(BEGIN, END, Path(ASKED), [machine(), "", *_HEAD, *ordered])
        written = DOCUMENT.read_text()
        missing = [what for what in self._rows if f"| {what} |" not in written]
        assert not missing, f"{DOCUMENT} has no row of {missing}; write it as this module says"


def ready(run: GuardedRun, keep_others: Callable[[], None] = lambda: None) -> None:
    """Let it drive: a run that lives is armed, one that has ended is started again.

    `keep_others` does that for what else it takes to drive.
    """
    wait_until(lambda: _drives(run, keep_others), "it drives", run.errors)


def _drives(run: GuardedRun, keep_others: Callable[[], None]) -> bool:
    keep_others()
    if run.run.poll() is not None:
        arguments, program = run.command
        run.start_instead(*arguments, program=program)  # a `disarm` of before may be waiting for it
    elif run.is_off:
        with suppress(ControlError):  # it has just ended
            ask(run.statistics, "arm")
    return not run.is_off


def _watched(run: GuardedRun, at: int) -> Trial:
    """Wait until all is off, and see whether it stays so."""
    took = run.until_off_ms(at)
    seen, until = len(run.lines()), at + round(took * 1e6) + STAYS_OFF
    wait_until(lambda: monotonic_ns() >= until, "a second has passed")
    on = [line for line in run.lines()[seen:] if line.get("value", 0.0) != 0.0]
    return Trial(took, on == [])


def _rows_of(document: Path) -> dict[str, str]:
    table = document.read_text().partition(BEGIN)[2].partition(END)[0]
    rows = [line for line in table.splitlines() if line.startswith("| ") and line not in _HEAD]
    return {row.split(" | ")[0].removeprefix("| "): row for row in rows}


def _row(what: str, goal_ms: float, trials: list[Trial]) -> str:
    took = [each.took_ms for each in trials]
    within = sum(each <= goal_ms for each in took)
    stayed = sum(each.stayed_off for each in trials)
    return (
        f"| {what} | {len(took)} | {median(took):.1f} | {max(took):.1f} | {goal_ms:g} | "
        f"{within} | {stayed} |"
    )
