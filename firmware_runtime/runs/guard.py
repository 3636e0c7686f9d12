"""The guard: watches over a run from another process, and switches off when it is dead or hangs.

    waiting --a run's file, its process alive--> watching
    watching --process gone--> holding;  --heartbeat older than the limit, or to come--> holding
    holding: full-off, again every POLL_EVERY until the chips have acknowledged, and as long as the
             run has not acknowledged the takeover, or its heartbeat is not right again
    holding, process gone, chips off--> waiting
    holding, takeover acknowledged, heartbeat right, chips off--> watching

It takes over by taking the run's right to drive (`watched_run`) first and writing full-off then. A
run that was only stopped, and comes back, finds that before its next write. If it had passed that
check when it was stopped, its one late write is overwritten at the next poll.

Nothing keeps it from writing full-off: what it watches comes first in every poll; parsing, printing
and noting come after. Whatever is raised there is printed and the guard goes on. It holds a reserve
of memory, which it releases when there is no other left. A file that takes the place of that of a
run which lives and drives changes nothing.

The guard never gives control back. The run has to be armed again. Full-off is also written where a
run has ended with its outputs off; then nothing was taken over, and nothing is noted.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from enum import Enum
from pathlib import Path
from time import monotonic_ns
from typing import Any, Protocol

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import StatisticsFileError, text_of
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.watched_run import WatchedRun, is_readable
from firmware_runtime.statistics.takeovers import Takeover
from firmware_runtime.system.reserve import Reserve

POLL_EVERY = 20 * MILLISECOND
ASK_AGAIN_EVERY = SECOND
"""Ns until what kept a run from being guarded is checked again."""

HOLD_AGAIN_AFTER = SECOND
"""Ns from a release of the reserve of memory until it is held again."""


class Phase(Enum):
    """Phase of a guard."""

    WAITING = "waiting for a run"
    WATCHING = "watching"
    HOLDING = "holding the outputs off"


class Outputs(Protocol):
    """Outputs that a guard can switch off."""

    def make_safe(self) -> list[str]:
        """Write full-off to every chip; return what failed, one sentence each."""

    def why_unguarded(self, conditions: Mapping[str, Any]) -> str | None:
        """Return why a run under these conditions would not be switched off from here, if so.

        It is watched all the same, as well as that goes, but its statistics do not say so.
        """

    def reach(self) -> None:
        """Open what outputs are switched off by, and keep it open.

        Raises HalError where those of a live run are out of reach: systemd, or the user that
        started this guard, starts another with the rights it lacks.
        """


class Guard:
    """Watches the run whose statistics are at `path`; a new file there is a new run.

    `stall` is how many ns old a heartbeat may be. `log` gets every takeover and its end;
    `record` keeps it, once the outputs are off or could not be switched off. Both come after the
    outputs, and whatever they raise is dropped.
    """

    def __init__(
        self,
        path: Path,
        outputs: Outputs,
        stall: int,
        log: Callable[[str], None],
        record: Callable[[Takeover], None] = lambda _: None,
    ) -> None:
        self.phase = Phase.WAITING
        self._path = path
        self._outputs = outputs
        self._stall = stall
        self._log = log
        self._record = record
        self._reserve = Reserve()
        self._run: WatchedRun | None = None  # kept when it is over: its inode is not used again
        self._seen: tuple[int, int] | None = None
        self._refused: tuple[int, int] | None = None
        self._why = self._stumble = ""
        self._since = self._takeovers = self._ask_at = self._hold_at = 0
        self._has_taken_right = False
        self._failed: list[str] | None = None
        self._unguarded_because: str | None = None
        self._is_said_gone = False

    @property
    def failed(self) -> list[str]:
        """Failures of a takeover that is not over, one sentence each."""
        return list(self._failed or ()) if self.phase is Phase.HOLDING else []

    def poll(self) -> None:
        """Poll once, and act; to be called every POLL_EVERY and when the run's process ends.

        Raises HalError when a run lives whose outputs are out of reach, and nothing else.
        """
        try:
            self._watch()
            self._find_run()
            self._show_presence()
            if not self._reserve.is_held and monotonic_ns() >= self._hold_at:
                self._reserve.hold()
        except HalError:
            raise
        except Exception as error:  # noqa: BLE001 -- whatever it is, the next poll comes
            self._release_reserve()
            self._say_stumble(error)

    def wait(self, wake_up: int) -> None:
        """Wait for the next poll: at most POLL_EVERY, less if the run ends or `wake_up` is read."""
        try:
            is_readable([wake_up, *([] if self._run is None else self._run.ends)], POLL_EVERY)
        except MemoryError:
            self._release_reserve()

    # Outputs --------------------------------------------------------------------------------------

    def _watch(self) -> None:
        run = self._run
        if run is None:
            return
        if self.phase is Phase.WATCHING and (why := run.why_lost(self._stall)):
            self.phase = Phase.HOLDING
            self._why, self._since = why, monotonic_ns()
            self._failed, self._has_taken_right = None, False
            self._takeovers += 1
        if self.phase is Phase.HOLDING:
            self._hold(run)

    def _hold(self, run: WatchedRun) -> None:
        self._has_taken_right = self._has_taken_right or run.take_right()
        failed = self._switch_off()
        if failed != self._failed:
            self._note(run, failed)
        if failed:
            return
        if run.has_ended:
            self.phase = Phase.WAITING
        elif self._has_taken_right and run.has_acknowledged and not run.why_lost(self._stall):
            self._switch_off()  # a write that was under way is over by now
            self.phase = Phase.WATCHING
            self._say("the run came back, disarmed")

    def _switch_off(self) -> list[str]:
        try:
            failed = self._outputs.make_safe()
        except Exception as error:  # noqa: BLE001 -- whatever it is, the next attempt comes
            failed = [text_of(error) or type(error).__name__]
        if failed:
            self._release_reserve()
        return failed

    def _note(self, run: WatchedRun, failed: list[str]) -> None:
        """Say how the takeover stands; only now, so that nothing comes before the outputs."""
        off_after = None if failed else monotonic_ns() - self._since
        is_first, self._failed = self._failed is None, failed
        if is_first and not failed and run.ended_with_outputs_off:
            self._say("the run has ended, with all outputs off")
            return
        takeover = Takeover(self._since, run.writer, self._takeovers, self._why, off_after, failed)
        self._say(f"takeover {takeover.number}: {takeover.text()}")
        with suppress(Exception):  # a full disk is no reason to stop watching
            self._record(takeover)

    # The run --------------------------------------------------------------------------------------

    def _find_run(self) -> None:
        """Take up a new file, unless the run before it still lives or is not switched off."""
        try:
            status = self._path.stat()
        except OSError:
            self._say_it_is_gone()
            return
        identity = status.st_dev, status.st_ino
        if identity == self._seen or self._is_busy():
            return
        if identity == self._refused and monotonic_ns() < self._ask_at:
            return
        try:
            run = WatchedRun(self._path)
        except StatisticsFileError as error:
            self._refuse(identity, error)
            return
        if self._run is not None:
            self._run.close()
        self._run, self._seen, self._refused = run, identity, None
        self._unguarded_because, self._ask_at = "not checked yet", 0
        self._takeovers = 0
        self._is_said_gone = False
        self.phase = Phase.WATCHING
        self._say(f"watching the run of process {run.writer.pid}")

    def _say_it_is_gone(self) -> None:
        """Say once of a run which goes on that its file was removed; what is mapped of it stays."""
        run = self._run
        if run is not None and not self._is_said_gone and not run.has_ended:
            self._is_said_gone = True
            self._say(
                f"{self._path} is gone, and the run of process {run.writer.pid} goes on: it is "
                "watched as before, and found by no command; SIGTERM ends it"
            )

    def _is_busy(self) -> bool:
        if self.phase is Phase.HOLDING and self._failed != []:
            return True
        return self._run is not None and self._run.drives

    def _refuse(self, identity: tuple[int, int], error: StatisticsFileError) -> None:
        """Say once what is wrong with a file; it may become another one."""
        self._ask_at = monotonic_ns() + ASK_AGAIN_EVERY
        if identity != self._refused:
            self._refused = identity
            self._say(f"no run can be watched there: {error}")

    def _show_presence(self) -> None:
        run = self._run
        if run is not None and self._could_switch_off(run) and not run.has_ended:
            run.show_presence()

    def _could_switch_off(self, run: WatchedRun) -> bool:
        """Return whether its outputs are within reach, as far as is known; check it again."""
        is_due = self.phase is Phase.WATCHING and monotonic_ns() >= self._ask_at
        if self._unguarded_because is not None and is_due:
            before, because = self._unguarded_because, self._outputs.why_unguarded(run.conditions)
            if because is None and not run.has_ended:
                self._outputs.reach()
            elif because not in {None, before}:
                self._say(f"this run is not guarded: {because}")
            self._unguarded_because = because
            self._ask_at = monotonic_ns() + ASK_AGAIN_EVERY
        return self._unguarded_because is None

    # ----------------------------------------------------------------------------------------------

    def _release_reserve(self) -> None:
        """Let the polls to come have the memory: held again at once, it would be of no use."""
        self._reserve.release()
        self._hold_at = monotonic_ns() + HOLD_AGAIN_AFTER

    def _say(self, what: str) -> None:
        with suppress(Exception):
            self._log(what)

    def _say_stumble(self, error: Exception) -> None:
        with suppress(Exception):
            stumble = f"{type(error).__name__}: {text_of(error)}; the guard goes on"
            if stumble != self._stumble:
                self._stumble = stumble
                self._log(stumble)
