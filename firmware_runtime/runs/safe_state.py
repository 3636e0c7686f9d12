"""Switching a board off for good: its runs are disarmed, outputs are switched off, then checked.

    take the right of every run that drives it -> full-off -> again every BETWEEN until all chips
    and all runs have acknowledged -> for WATCH, read back what can be read; off again what is on

What is said to be off has stayed off, as far as it can be read back, with every run that lives
knowing that it must not drive.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns
from typing import TYPE_CHECKING

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.active_runs import (
    holders_of,
    is_driven,
    lines_of,
    run_at,
    statistics_of,
)
from firmware_runtime.runs.outputs import Outputs, kept_settings, switched_off
from firmware_runtime.runs.watched_run import WatchedRun, note_safe_state
from firmware_runtime.statistics.paths import Companion

if TYPE_CHECKING:
    from firmware_runtime.system.device_nodes import Holder

BETWEEN = 20 * MILLISECOND
WATCH = SECOND // 2
"""Ns for which outputs must have stayed off where a process drives them, or may."""


class SafeState:
    """Switches off what some boards mean, the first of them as its file has it.

    `doubles` is where they are served, None on the real robot; `statistics` is where a run of
    theirs is expected to keep its own, if that is known.
    """

    def __init__(
        self, meant: Sequence[Board], doubles: Path | None, statistics: Path | None
    ) -> None:
        self._meant = list(meant)
        self._doubles = doubles
        self._outputs = [Outputs(board, doubles, statistics) for board in meant]
        self._lines = sorted({line for board in meant for line in lines_of(board, doubles)})
        self._places = self._lines if doubles is None else [str(doubles.resolve())]
        self._statistics = statistics
        self._runs: dict[int, WatchedRun] = {}
        self._is_driven = self._is_known = False
        self._holders: list[Holder] = []
        self._not_noted = ""
        self.statistics_found: set[Path] = set()
        """Where else the runs that were found keep their statistics."""

    def take_right(self) -> None:
        """Take it from the run that is expected; quick."""
        if self._statistics is not None:
            self._take_from(self._statistics, self._statistics)

    def warn_runs_to_come(self) -> None:
        """Let a run that is starting know of this; before `find_runs`, so that it misses none."""
        if self._statistics is None:
            return
        try:
            note_safe_state(self._statistics)
        except OSError as error:
            self._not_noted = (
                f"{Companion.SAFE_STATE.beside(self._statistics)}: {error.strerror}; expected a "
                "place to write: a run that is starting does not learn of this, and may arm itself"
            )

    def find_runs(self) -> None:
        """Take it from every run that has the lines; looks through all processes."""
        self._is_driven = is_driven(self._lines)
        self._holders = holders_of(self._lines)
        for file, name in statistics_of(self._holders):
            self._is_known = True
            self._take_from(file, name)
            self.statistics_found.add(name)

    def make_safe(self) -> list[str]:
        """Write full-off to every chip; return what failed, one sentence each."""
        return [failure for each in self._outputs for failure in each.make_safe()]

    def has_acknowledged(self) -> bool:
        """Return whether every run that lives knows that it must not drive, and is off.

        A run that still finds its chips has no statistics yet: it is looked for again.
        """
        if self._is_silent:
            self.find_runs()
        return not (self._is_silent or self._unaware())

    def stays_off(self, give_up_at: int, wait: Callable[[], bool]) -> list[str]:
        """Check that all stays off, as long as it takes; return what was on last.

        `wait` lets BETWEEN pass and returns whether a signal came, which ends it.
        """
        must_stay = WATCH if self._is_driven or self._living() else 0
        since = monotonic_ns()
        on: list[str] = []
        while True:
            seen = [each for outputs in self._outputs for each in outputs.outputs_on()]
            if seen:
                on = [*seen, *self.make_safe()]
                self._take_again()
                since = monotonic_ns()
            elif monotonic_ns() - since >= must_stay:
                return self._at_risk()
            if monotonic_ns() >= give_up_at:
                return [*on, *self._who_may(on), *self._at_risk()]
            if wait():
                return [*on, *self._who_may(on), f"not checked for {must_stay / SECOND:g} s"]

    def warnings(self) -> list[str]:
        """Return warnings of runs that live, and of processes that may become runs."""
        found = [
            f"process {pid} has not acknowledged that it must not drive: stopped, or it hangs; a "
            "write that was under way may still come; end it"
            for pid in self._unaware()
        ]
        if self._is_silent:
            holds = f"holds {', '.join(self._lines)} and keeps no statistics"
            found += [
                f"{process} {holds}: it may still drive, as a run that starts; end it"
                for process in self._processes()
            ]
        return [*found, self._not_noted] if self._not_noted else found

    @property
    def is_over(self) -> bool:
        """Return whether no run lives that could be armed again."""
        return not self._living() and not self._is_driven

    def close(self) -> None:
        """Release buses and processes."""
        for outputs in self._outputs:
            outputs.close()
        for run in self._runs.values():
            run.close()

    # ----------------------------------------------------------------------------------------------

    def _take_from(self, file: Path, name: Path) -> None:
        """Take the right of a run whose statistics are open at `file` and were made at `name`."""
        try:
            run = run_at(file, self._places)
        except StatisticsFileError:  # none; or of another version, which can be requested at least
            _ask_to_disarm(name)
            return
        if run is None:
            return
        pid = run.writer.pid
        if pid in self._runs:  # what a process has open counts, not what lies where it was made
            self._runs[pid].close()
        self._runs[pid] = run
        if not run.take_right(by_request=True):
            _ask_to_disarm(name)
        self._add_kept(name)

    def _add_kept(self, statistics: Path) -> None:
        """Switch off what a run keeps as its settings too, where that means something else."""
        kept = kept_settings(statistics)
        if kept is None:
            return
        off = switched_off(kept, self._doubles)
        if all(off != switched_off(board, self._doubles) for board in self._meant):
            self._meant.append(kept)
            self._outputs.append(Outputs(kept, self._doubles, statistics))

    def _take_again(self) -> None:
        for run in self._runs.values():
            if not run.was_disarmed_by_request:  # a guard has taken it since
                run.take_right(by_request=True)

    def _who_may(self, on: list[str]) -> Iterator[str]:
        """The processes with the lines open, where something is on."""
        for process in self._processes() if on else ():
            yield f"{process} has {', '.join(self._lines)} open"

    def _processes(self) -> list[str]:
        """The processes with the lines for themselves, or open if there is none, in words."""
        drivers = [each for each in self._holders if each.is_alone] or self._holders
        found = sorted({(each.process, each.command) for each in drivers})
        return [f"process {process} ({command})" for process, command in found]

    @property
    def _is_silent(self) -> bool:
        """True if a process has the lines for itself of which nothing else is known."""
        return self._is_driven and not self._is_known and not self._living()

    def _living(self) -> list[int]:
        return [pid for pid, run in self._runs.items() if not run.has_ended]

    def _unaware(self) -> list[int]:
        self._take_again()
        return [
            pid
            for pid in self._living()
            if not (self._runs[pid].was_disarmed_by_request and self._runs[pid].has_acknowledged)
        ]

    def _at_risk(self) -> list[str]:
        """Return what may come on, or be on, though nothing was seen to be."""
        return [*self._unseen_at_risk(), *self._hidden()]

    def _hidden(self) -> Iterator[str]:
        """A process that this user may not look into: its right to drive could not be taken."""
        if self._is_silent and not self._holders:
            yield (
                f"a process of another user may drive what is on {', '.join(self._lines)}, and its "
                "right to drive cannot be taken from here; expected root, or that user"
            )

    def _unseen_at_risk(self) -> list[str]:
        """Return what cannot be read back while a run lives that may still drive it."""
        unaware = self._unaware()
        if not unaware:
            return []
        found: list[str] = []
        for outputs in self._outputs:
            with suppress(HalError):
                found += (
                    f"{place} cannot be read back, and process {unaware[0]} may drive it"
                    for place in outputs.unseen
                )
        return found


def _ask_to_disarm(statistics: Path) -> None:
    """Ask a run whose right cannot be taken to disarm itself; its answer is not waited for."""
    from firmware_runtime.links.control import post  # noqa: PLC0415 -- few runs have to be asked

    post(statistics, "disarm")
