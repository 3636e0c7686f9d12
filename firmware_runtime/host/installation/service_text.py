"""How an installed board and its guard do, and what they wrote to the journal, as text."""

import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict
from datetime import datetime
from typing import Any

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import (
    StatisticsFileError,
)
from firmware_runtime.host.installation.plan import GUARD, RUNTIME
from firmware_runtime.host.installation.target import UnitState
from firmware_runtime.runs.restarts import pause_after, read_starts
from firmware_runtime.statistics.paths import find_statistics, places
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.summary import summary

EPISODE_FIELDS = ("PERIOD_US", "LATE_US", "MISSED", "CAUSE")
"""What the journal's entry on an episode of overruns has, and no other entry."""
_MICROSECONDS = 1_000_000


SCHEMA = 1
SERVICES = {"runtime": RUNTIME, "guard": GUARD}


def service_document(states: dict[str, dict[str, UnitState]]) -> dict[str, object]:
    """Return how boards do by systemd and by their statistics, for JSON."""
    return {
        "schema": SCHEMA,
        "boards": {
            board: {
                **{name: asdict(unit) for name, unit in units.items()},
                "failed_starts": _failed_starts(board),
                "statistics": _summary_or_none(board),
            }
            for board, units in states.items()
        },
    }


def service_lines(board: str, units: dict[str, UnitState]) -> Iterator[str]:
    """Yield how one board does: a line a unit, then its starts and its statistics."""
    yield f"{board:10}  {'state':22} {'since':30} {'process':>8} {'restarts':>9} {'watchdog':>9}"
    for name, unit in units.items():
        state = f"{unit.active or 'unknown'} ({unit.sub or 'unknown'})"
        since, process = unit.since or "-", str(unit.pid or "-")
        watchdog = unit.watchdog or "-"
        yield f"  {name:8}  {state:22} {since:30} {process:>8} {unit.restarts:>9} {watchdog:>9}"
        if unit.result not in {"", "success"}:
            yield f"{'':12}ended with {unit.result}"
        if unit.says:
            yield f"{'':12}{unit.says}"
    if failed := _failed_starts(board):
        pause_s = pause_after(failed) / SECOND
        yield f"  starts      {failed} failed in a row before this one, which waited {pause_s:g} s"
    yield f"  statistics  {_summary_or_reason(board)}"


def _failed_starts(board: str) -> int:
    """Starts in a row that failed before the one under way; 0 after a minute of health."""
    found = (read_starts(path) for path in places(board))
    return next((starts.failed for starts in found if starts is not None), 0)


def _summary(board: str) -> str:
    """The run under way, or the last, in a line. Raises StatisticsFileError."""
    return summary(read_statistics(find_statistics(board)).figures())


def _summary_or_none(board: str) -> str | None:
    with suppress(StatisticsFileError):
        return _summary(board)
    return None


def _summary_or_reason(board: str) -> str:
    try:
        return _summary(board)
    except StatisticsFileError as error:
        return str(error)


def episodes(entries: Iterable[str]) -> Iterator[str]:
    """A line for every episode among journal entries in JSON; a heading first."""
    yield f"{'when':26}  {'model':24} {'PERIOD_US':>9} {'LATE_US':>9} {'MISSED':>6}  CAUSE"
    for entry in map(json.loads, entries):
        if all(field in entry for field in EPISODE_FIELDS):
            yield _episode(entry)


def _episode(entry: dict[str, Any]) -> str:
    seconds, rest = divmod(int(entry["__REALTIME_TIMESTAMP"]), _MICROSECONDS)
    when = datetime.fromtimestamp(seconds).astimezone().replace(microsecond=rest)
    period, late, missed, cause = (entry[field] for field in EPISODE_FIELDS)
    return (
        f"{when:%Y-%m-%d %H:%M:%S.%f}  {entry.get('MODEL', '-'):24} "
        f"{period:>9} {late:>9} {missed:>6}  {cause}"
    )
