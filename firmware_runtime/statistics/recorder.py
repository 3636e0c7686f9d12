"""Keeps what a board's runs leave behind: their statistics, and what happened at each incident.

It reads the files that the run and the guard write anyway, in a process of its own. In its folder,
for the board's seventh run, are its statistics as they stood a minute ago at most, or at the end:
`tachobot-0007.stats`. What is kept of the run's recording is beside them, a piece for each
activation that was late and each takeover by the guard, see `blackbox.pieces`. Old runs make room
for new ones. Everything can be read by the verbs that read a run under way.
"""

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file import save
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.late_watch import Late, LateWatch
from firmware_runtime.statistics.paths import SUFFIX
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.takeovers import takeovers_of

SAVE_EVERY = 60 * SECOND
AFTERMATH = SECOND // 2
"""How long after an incident its piece is taken, so that it shows what came of it."""
QUIET = 10 * SECOND
"""What is late so soon after an incident was kept is one incident, kept when this is over."""
MOST_LATE = 20
"""Late incidents of one run; one that is late all the time would fill the disk."""


class Pieces(Protocol):
    """Keeps the recording of one run at a time, all of it or in pieces."""

    def begin(self, stem: Path, pid: int) -> None:
        """A run has begun, of this process; names of what is kept of it begin with `stem`."""

    def poll(self, now: int) -> None:
        """Copy what is new, if it is time to."""

    def sync(self) -> None:
        """Copy what is new, now."""

    def keep(self, why: str, number: int) -> None:
        """Keep what came before this moment: `why` is `late` or `guard`."""

    def over(self) -> None:
        """The run is over, or another one has begun."""

    def close(self) -> None:
        """Let go of the run."""


class Recorder:
    """Follows the runs whose statistics are at `kept`; writes into `folder`, the last `runs` runs.

    `late` is the lateness, ns, over which an activation is an incident; None takes the least
    tolerance of the run's own models. `log` gets a line for every file, `pieces` keeps the run's
    recording. Raises StatisticsFileError if the folder cannot be written.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- handed over once, by the verb
        self,
        kept: Path,
        folder: Path,
        runs: int,
        late: int | None,
        log: Callable[[str], None],
        pieces: Pieces,
    ) -> None:
        self._kept = kept
        self._folder = folder
        self._runs = runs
        self._late = late
        self._log = log
        self._pieces = pieces
        self._run: _Run | None = None

    def poll(self, now: int) -> None:
        """Look once; to be called some ten times a second, with CLOCK_MONOTONIC in ns."""
        try:
            statistics = read_statistics(self._kept)
        except StatisticsFileError:
            return  # none yet, or one that is being made
        if self._run is None or self._run.is_another(statistics):
            if self._run is not None:
                self._run.replaced()
            self._run = self._begin(statistics, now)
        self._run.poll(statistics, now)

    def close(self, now: int) -> None:
        """Keep what is known of the run under way, up to this moment."""
        self.poll(now)
        if self._run is not None and not self._run.is_over:
            self._run.close()
            self._pieces.sync()
        self._pieces.close()

    def _begin(self, statistics: Statistics, now: int) -> "_Run":
        """Give a new run the next number and make room for it; one that is known keeps its own."""
        numbers = self._numbers()
        number = max(numbers, default=0)
        if not self._is_kept(number, statistics):
            number += 1
            for old in sorted(numbers)[: max(0, len(numbers) - self._runs + 1)]:
                for path in self._folder.glob(f"{self._name(old)}[.-]*"):
                    path.unlink()
        self._log(f"keeping run {number} of {self._kept.stem} in {self._folder}")
        stem = self._folder / self._name(number)
        self._pieces.begin(stem, statistics.header.writer.pid)
        return _Run(self._kept, stem, statistics, self._late, self._log, self._pieces, now)

    def _is_kept(self, number: int, statistics: Statistics) -> bool:
        """Return whether that number is this run's, from before this recorder was started."""
        with suppress(StatisticsFileError):
            kept = read_statistics(self._folder / f"{self._name(number)}{SUFFIX}")
            return kept.header.writer == statistics.header.writer
        return False

    def _numbers(self) -> set[int]:
        pattern = re.compile(rf"{re.escape(self._kept.stem)}-(\d{{4,}})[.-]")
        found = (pattern.match(path.name) for path in self._folder.iterdir())
        return {int(match[1]) for match in found if match}

    def _name(self, number: int) -> str:
        return f"{self._kept.stem}-{number:04}"


@dataclass(frozen=True, slots=True)
class _Incident:
    """Incident to be kept at `due`: of the guard, or of the latest of its late activations."""

    late: Late | None
    due: int

    @property
    def kind(self) -> str:
        """As in the names of what is kept of it."""
        return "guard" if self.late is None else "late"

    def with_later(self, late: Late) -> "_Incident":
        """The same, in which this activation was late, too."""
        if self.late is None or self.late.lateness_ns >= late.lateness_ns:
            return self
        return replace(self, late=late)


class _Run:
    """One run: files whose names begin with `stem`."""

    def __init__(  # noqa: PLR0913, PLR0917 -- handed over once, by the recorder
        self,
        kept: Path,
        stem: Path,
        statistics: Statistics,
        late: int | None,
        log: Callable[[str], None],
        pieces: Pieces,
        now: int,
    ) -> None:
        self._kept = kept
        self._stem = stem
        self._log = log
        self._pieces = pieces
        self._latest = statistics
        self._watch = _watch(statistics, late)
        self._takeovers = len(takeovers_of(kept, statistics.header.writer))
        self._save_at = now
        self._incidents = max(map(_number, stem.parent.glob(f"{stem.name}-*-*.*")), default=0)
        self._incident: _Incident | None = None
        self._quiet_until = 0
        self._is_full_said = False
        self.is_over = False

    def is_another(self, statistics: Statistics) -> bool:
        """Return whether these are the statistics of a later run."""
        return statistics.header.writer != self._latest.header.writer

    def poll(self, statistics: Statistics, now: int) -> None:
        """Note incidents, keep those that are due, keep the statistics now and then."""
        self._latest = statistics
        was_over, self.is_over = self.is_over, not _is_under_way(statistics)
        self._notice(statistics, now)
        if not was_over:
            self._pieces.poll(now)
        if self._incident is not None and (now >= self._incident.due or self.is_over):
            self._keep_incident(self._incident)
            self._incident = None
        if self.is_over and not was_over:
            self._pieces.over()
        if (self.is_over and not was_over) or (now >= self._save_at and not self.is_over):
            self._save_at = now + SAVE_EVERY
            self.keep()

    def replaced(self) -> None:
        """Keep what was last seen: the next run has begun."""
        if not self.is_over:
            self.close()
            self._pieces.over()

    def close(self) -> None:
        """Keep what is known of a run that is followed no more."""
        if self._incident is not None:
            self._keep_incident(self._incident)
            self._incident = None
        self.keep()

    def keep(self) -> None:
        """Write the latest statistics; logged once the run is over."""
        path = self._stem.with_name(self._stem.name + SUFFIX)
        save(self._latest, path)
        if self.is_over:
            self._log(f"{path}: the run is over, its statistics are kept")

    def _notice(self, statistics: Statistics, now: int) -> None:
        takeovers = len(takeovers_of(self._kept, statistics.header.writer))
        late = None if self._watch is None else self._watch.new_in(statistics)
        if takeovers > self._takeovers and statistics.state is RunState.RUNNING:
            self._incident = _Incident(None, now + AFTERMATH)
        elif late is not None:
            due = max(now + AFTERMATH, self._quiet_until)
            self._incident = (self._incident or _Incident(late, due)).with_later(late)
            self._quiet_until = self._incident.due + QUIET
        self._takeovers = takeovers

    def _keep_incident(self, incident: _Incident) -> None:
        """Keep the piece of the recording, of so many late activations."""
        if incident.late is not None and self._incidents >= MOST_LATE:
            if not self._is_full_said:
                self._is_full_said = True
                fault = f"{MOST_LATE} incidents are kept; no more late activations of this run are"
                self._log(f"{self._stem}: {fault}")
            return
        self._incidents += 1
        self._log(f"incident {self._incidents}: {incident.late or 'the guard took over'}")
        self._pieces.keep(incident.kind, self._incidents)


def _watch(statistics: Statistics, late: int | None) -> LateWatch | None:
    """Return what notices late activations; None for a run without models."""
    tolerances = [stated.tolerance_ns for stated in statistics.header.models.values()]
    if not tolerances:
        return None
    return LateWatch(min(tolerances) if late is None else late, statistics)


def _number(path: Path) -> int:
    """Return the number of an incident, by the name of what was kept of it."""
    said = path.name.partition(".")[0].rpartition("-")[2]
    return int(said) if said.isdecimal() else 0


def _is_under_way(statistics: Statistics) -> bool:
    return statistics.state is RunState.RUNNING and statistics.writer_alive
