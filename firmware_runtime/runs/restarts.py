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

from pathlib import Path
from time import monotonic_ns
from typing import Annotated, Final

from msgspec import Meta

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.process_identity import NoteOfBoot, boot_id, leave_note, read_note

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
    """Those of this boot; None where none are counted, or what is there is no such file."""
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
