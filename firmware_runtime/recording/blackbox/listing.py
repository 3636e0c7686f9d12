"""What a recording is, in a row: of which run, which span of it, how the run ended, why it is kept.

A kept one is named `tachobot-0007-crash-1.recording`: the board's seventh run, why, the how manieth
of that run; without a reason it is the copy that grew with the run.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError
from firmware_runtime.recording.blackbox.locations import (
    FAILED_START,
    VIRTUAL,
    find_recording,
    state_folder,
)
from firmware_runtime.recording.blackbox.reader import (
    Recording,
    end_in,
    instants_in,
    read_recording,
)
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.number_formats import local, utc
from firmware_runtime.statistics.paths import SUFFIX, Companion, directories
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.this_process import exists
from firmware_runtime.system.whole_numbers import whole_number

LAST: Final = "last run"
START: Final = "start"
KEPT_RUN: Final = "kept"
GROWN: Final = "synced"
WENT_ON: Final = "went on"
UNKNOWN: Final = "unknown"
_KEPT: Final = re.compile(r"-\d{4,}(?:-([a-z]+)-\d+)?\.recording$")
_NAMED_AS_ITS_RUN: Final = re.compile(r"-[0-9a-f]{9,}-\d+\.recording$")
"""What `recordings keep` calls a file: the board, when the run began, its process."""
_HIGHEST_PROCESS: Final = 1 << 22
"""Linux numbers none higher."""


@dataclass(frozen=True, slots=True)
class Listed:
    """One recording; of one that cannot be read `fault` says why, and the rest is empty."""

    name: str
    """What `replay` and `export` take."""
    path: Path
    board: str = ""
    run: str = ""
    begin: int = 0
    until: int = 0
    """First and last instant of the run in it, ns."""
    size: int = 0
    """Bytes of its file."""
    end: str = ""
    """Its state; else `killed`, `running`, `went on` (after this piece) or `unknown`: not in it."""
    why: str = ""
    """`crash`, `guard`, `late`, `synced`, `kept`, `start`, `last run`; empty for any other file."""
    faults: tuple[str, ...] = ()
    """What is not whole in it."""
    fault: str | None = None
    began: int | None = None
    """The date of the run's start, ns since 1970."""

    def as_json(self) -> dict[str, object]:
        """For a program."""
        return {
            "name": self.name,
            "file": str(self.path),
            "board": self.board,
            "run": self.run,
            "began": None if self.began is None else utc(self.began),
            "from_s": self.begin / SECOND,
            "to_s": self.until / SECOND,
            "bytes": self.size,
            "end": self.end,
            "why": self.why,
            "whole": self.fault is None and not self.faults,
            "faults": list(self.faults) if self.fault is None else [self.fault],
        }


def listed(path: Path) -> Listed:
    """The row of a file."""
    name, why = name_of(path), why_kept(path)
    try:
        recording = read_recording(path)
        size = path.stat().st_size
    except (ConfigError, OSError) as error:
        return Listed(name, path, why=why, fault=str(error))
    begin, until = span_of(recording)
    header = recording.header
    return Listed(
        name,
        path,
        header.board,
        header.run,
        begin,
        until,
        size,
        _end(recording, why),
        why,
        tuple(recording.faults()),
        began=recording.dates().of(0),
    )


def name_of(path: Path) -> str:
    """The shortest that means this file: a name, or else its path."""
    for name in (path.name.removesuffix(VIRTUAL).removesuffix(FAILED_START), path.stem):
        try:
            if find_recording(name) == path:
                return name
        except ConfigError:
            continue
    return str(path)


def why_kept(path: Path) -> str:
    """By its name."""
    if path.name.endswith(FAILED_START):
        return START
    if state_folder() in path.parents:
        return KEPT_RUN
    found = _KEPT.search(path.name)
    if found is not None and _NAMED_AS_ITS_RUN.search(path.name) is None:
        return found[1] or GROWN
    return LAST if path.parent in directories() else ""


def span_of(recording: Recording) -> tuple[int, int]:
    """First and last instant of the run in a recording, ns; a run's beginning is instant 0."""
    ats = list(instants_in(recording.contents()))
    return (min(ats), max(ats)) if ats else (0, 0)


def _end(recording: Recording, why: str) -> str:
    last = recording.chunks[-1]
    if end := end_in(last.contents):
        return str(end.get("state"))
    if why in {"guard", "late"}:
        return WENT_ON
    if not why or last.damage:
        return UNKNOWN
    if why in {LAST, GROWN} and _is_under_way(recording):
        return "running"
    return UNKNOWN if why == GROWN and _has_ended(recording.path) else "killed"


def _has_ended(path: Path) -> bool:
    """Whether the statistics that are kept beside a copy say that its run came to an end."""
    try:
        return read_statistics(path.with_suffix(SUFFIX)).state is not RunState.RUNNING
    except StatisticsFileError:
        return False


def _is_under_way(recording: Recording) -> bool:
    """Whether the process of the run is still there, by its statistics, else by its number."""
    pid = recording.header.run.rpartition("-")[2]
    path = recording.path
    if not path.name.endswith(VIRTUAL):
        try:
            statistics = read_statistics(path.with_suffix(SUFFIX))
        except StatisticsFileError:
            pass
        else:
            is_running = statistics.writer_alive and statistics.state is RunState.RUNNING
            return is_running and str(statistics.header.writer.pid) == pid
    number = whole_number(pid, _HIGHEST_PROCESS) or 0
    return path.suffix == Companion.RECORDING and number > 0 and exists(number)


def without_copies(rows: Sequence[Listed]) -> list[Listed]:
    """Without the copies of runs that are still in memory."""
    last = {each.run for each in rows if each.why == LAST}
    return [each for each in rows if each.why != KEPT_RUN or each.run not in last]


def table_of(rows: Sequence[Listed]) -> Iterator[str]:
    """Yield a heading, and a line for each."""
    width = max(len(each.name) for each in rows)
    spans = f"{'FROM S':>9}  {'TO S':>9}  {'MIB':>6}"
    yield f"{'NAME':{width}}  {spans}  {'END':8}  {'WHY':8}  {'BEGAN':28}  WHOLE"
    for each in rows:
        if each.fault is not None:
            yield f"{each.name:{width}}  {each.fault}"
            continue
        whole = "yes" if not each.faults else f"no: {'; '.join(each.faults)}"
        span = f"{each.begin / SECOND:9.3f}  {each.until / SECOND:9.3f}"
        began = "-" if each.began is None else local(each.began)
        size = f"{each.size / (1 << 20):6.1f}"
        end = f"{each.end:8}  {each.why:8}  {began:28}"
        yield f"{each.name:{width}}  {span}  {size}  {end}  {whole}"
