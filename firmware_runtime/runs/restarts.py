"""Starts of a service that failed one after the other, and how long the next one waits.

systemd starts a run again half a second after it has ended (`RestartSec=` of the unit), as often as
it takes. Where one start fails like the other that is too often, and on a slow machine the starts
alone take all processor time. So the run itself waits before it opens or asks for anything:

    failed in a row   0 or 1     2     3     4     5     6     7 and more
    pause             0.5 s      1     2     4     8    16     30 s          systemd's included

Older systemd has no such back-off of its own (RestartSteps= came with 254). Meanwhile outputs are
off: `ExecStopPost=` saw to it, the guard is there, and no process holds the bus.

A start has failed unless the run then lasted `HEALTHY_AFTER`, ended by request or because its task
was over, or refused its settings, which no start fixes. `BOARD.starts` beside the statistics has
how many there were, those of this boot.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns
from typing import Annotated, Final

from msgspec import Meta

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import until_signal
from firmware_runtime.system.this_process import NoteOfBoot, boot_id, leave_note, read_note

HEALTHY_AFTER: Final = 60 * SECOND
FIRST_PAUSE: Final = SECOND // 2
"""`RestartSec=` of the unit, ns: what systemd waits before any start but the first."""
LONGEST_PAUSE: Final = 30 * SECOND
FORGOTTEN_AFTER: Final = 600 * SECOND
"""Ns after which a start without any record since says nothing about the next."""
_RESERVE: Final = 5 * MILLISECOND
_PATIENCE: Final = SECOND
_MODE: Final = 0o640


class Starts(NoteOfBoot, frozen=True, kw_only=True):
    """`failed` starts before the one under way, which began `at_ns` (CLOCK_MONOTONIC)."""

    failed: Annotated[int, Meta(ge=0)]


def pause_after(failed: int) -> int:
    """Ns from the end of one start to the next, after so many that failed in a row."""
    return min(FIRST_PAUSE << min(max(failed - 1, 0), 16), LONGEST_PAUSE)


def read_starts(statistics: Path) -> Starts | None:
    """Return the starts of this boot; None where none are counted."""
    return read_note(Companion.STARTS.beside(statistics), Starts)


class Restarts:
    """Counts the starts of the run with these statistics, and is a hook of the run."""

    def __init__(self, statistics: Path) -> None:
        self._statistics = statistics
        before, oldest = read_starts(statistics), monotonic_ns() - FORGOTTEN_AFTER
        self.failed = 0 if before is None or before.at_ns < oldest else before.failed + 1
        self._healthy_at = HEALTHY_AFTER

    @property
    def wait(self) -> int:
        """Ns to wait before this start, beyond what systemd has waited."""
        return pause_after(self.failed) - FIRST_PAUSE

    def begin(self) -> None:
        """Count this start as failed until it is forgotten. Raises OSError."""
        starts = Starts(boot_id=boot_id(), failed=self.failed, at_ns=monotonic_ns())
        leave_note(Companion.STARTS.beside(self._statistics), starts, _MODE)

    def forget(self) -> None:
        """This start was good, and those before it do not count any more. Raises OSError."""
        self._healthy_at = NEVER
        Companion.STARTS.beside(self._statistics).unlink(missing_ok=True)

    def between_steps(self, now: int, left: int) -> None:
        """Forget the starts that failed once the run has lasted, when there is time for it."""
        if now >= self._healthy_at and (left >= _RESERVE or now >= self._healthy_at + _PATIENCE):
            try:
                self.forget()
            except OSError:  # the next end counts as one more failure, no worse
                self._healthy_at = NEVER


_GOOD = {Status.OK, Status.BAD_INPUT, Status.INTERRUPTED, Status.TERMINATED, Status.NOT_PRINTED}
"""No start that failed: as requested, or not to be fixed by another start."""


def counted(
    run: Callable[[Restarts | None], int],
    statistics: Path | None,
    notices: Notices,
    within: int,
    meanwhile: str = "outputs are off",
) -> int:
    """Run where a manager starts it again and again: wait if the last starts failed, and count.

    `within` is how long the start may take after the wait, ns; `meanwhile` is what holds during
    the wait. SIGTERM ends it.
    """
    if statistics is None or not notices.is_there:
        return run(None)
    restarts = Restarts(statistics)
    if _is_stopped(restarts, notices, within, meanwhile):
        _forget(restarts)
        return Status.TERMINATED
    return _counted(run, restarts)


def _counted(run: Callable[[Restarts | None], int], restarts: Restarts) -> int:
    """Run, and forget the starts that failed if this one did not."""
    with suppress(OSError):  # no place for statistics either: the run says so itself
        restarts.begin()
    try:
        status = run(restarts)
    except (ConfigError, StatisticsFileError):
        _forget(restarts)
        raise
    if status in _GOOD:
        _forget(restarts)
    return status


def _is_stopped(restarts: Restarts, notices: Notices, within: int, meanwhile: str) -> bool:
    """Wait as long as this start must; whether a signal came meanwhile."""
    if restarts.wait == 0:
        return False
    wait_s = restarts.wait / SECOND
    said = f"the last {restarts.failed} starts failed: waits {wait_s:g} s, {meanwhile}"
    with until_signal() as signal:
        notices.progress(said, restarts.wait + within)
        return signal.wait(wait_s)


def _forget(restarts: Restarts) -> None:
    with suppress(OSError):
        restarts.forget()
