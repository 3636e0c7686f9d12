"""The guard: watches over a run from another process, and switches off when it is dead or hangs.

    waiting --a run's file, its process alive--> watching
    watching --process gone--> holding;  --no finished step for the limit--> holding
    holding: full-off, again every LOOK_EVERY until the chips have acknowledged, and as long as the
             run has not acknowledged the takeover
    holding, process gone, chips off--> waiting;  takeover acknowledged, chips off--> watching

It takes over by raising the generation in the statistics file first and writing full-off then. A
run that was only stopped, and comes back, finds the generation before its next write. If it had
passed that check when it was stopped, its one late write is overwritten at the next look.

The guard never gives control back. The run has to be armed anew, by somebody.
"""

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from enum import Enum
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import Any, Protocol

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.layout import ACKNOWLEDGED, GENERATION, GUARD, HEARTBEAT
from firmware_runtime.telemetry.process_identity import is_running
from firmware_runtime.telemetry.statistics_file import STATISTICS
from firmware_runtime.telemetry.takeovers import Takeover

LOOK_EVERY = 20 * MILLISECOND
ASK_AGAIN_EVERY = SECOND
"""Ns until what kept a run from being guarded is looked at again."""


class Phase(Enum):
    """What the guard is doing."""

    WAITING = "waiting for a run"
    WATCHING = "watching"
    HOLDING = "holding the outputs off"


class Outputs(Protocol):
    """What a guard can switch off."""

    def make_safe(self) -> list[str]:
        """Write full-off to every chip; return what failed, one sentence each."""

    def objection(self, conditions: Mapping[str, Any]) -> str | None:
        """Why a run under these conditions would not be switched off from here, if so.

        It is watched all the same, as well as that goes, but it is not told that it is.
        """

    def reach(self) -> None:
        """Raise HalError where the outputs of a run that lives are out of reach.

        Whoever started this guard starts another, with better leave.
        """


class Guard:
    """Watches the run whose statistics are at `path`; a new file there is a new run.

    `stall` is how many ns without a finished step count as dead. `tell` hears of every takeover and
    its end; `record` keeps it, once the outputs are off or could not be switched off.
    """

    def __init__(
        self,
        path: Path,
        outputs: Outputs,
        stall: int,
        tell: Callable[[str], None],
        record: Callable[[Takeover], None] = lambda _: None,
    ) -> None:
        self.phase = Phase.WAITING
        self._path = path
        self._outputs = outputs
        self._stall = stall
        self._tell = tell
        self._record = record
        self._run: _Run | None = None
        self._seen: tuple[int, int] | None = None
        self._takeover: Takeover
        self._failed: list[str] | None = None
        self._objection: str | None = None
        self._ask_at = 0

    @property
    def failed(self) -> list[str]:
        """What a takeover that is not over could not switch off, one sentence each."""
        return list(self._failed or ()) if self.phase is Phase.HOLDING else []

    def look(self) -> None:
        """Look once, and act; to be called every LOOK_EVERY and when the run's process ends.

        Raises HalError when a run lives whose outputs are out of reach.
        """
        self._find_run()
        if self._run is not None:
            if self._could_switch_off(self._run) and not self._run.has_ended:
                self._run.show_presence()
            if self.phase is Phase.WATCHING and (why := self._run.is_lost(self._stall)):
                self._take_over(why)
            if self.phase is Phase.HOLDING:
                self._hold(self._run)

    def wait(self, wake_up: int) -> None:
        """Wait for the next look: at most LOOK_EVERY, less if the run ends or `wake_up` is read."""
        ends = [] if self._run is None else self._run.ends
        select([wake_up, *ends], (), (), LOOK_EVERY / SECOND)

    # ---------------------------------------------------------------------------------------------

    def _find_run(self) -> None:
        """Take up a new file, unless a takeover from the run before is not over."""
        try:
            status = self._path.stat()
        except OSError:
            return
        identity = status.st_dev, status.st_ino
        if identity == self._seen or (self.phase is Phase.HOLDING and self._failed != []):
            return
        with suppress(StatisticsFileError):  # not whole yet, or not ours: the next look tells
            run = _Run(self._path)
            self._seen = identity
            if self._run is not None:
                self._run.close()
            self._run = run
            self._objection, self._ask_at = "not asked yet", 0
            self.phase = Phase.WATCHING

    def _could_switch_off(self, run: "_Run") -> bool:
        """Whether nothing is known that speaks against it; what did is looked at again."""
        if self._objection is not None and monotonic_ns() >= self._ask_at:
            before, self._objection = self._objection, self._outputs.objection(run.conditions)
            if self._objection is None and not run.has_ended:
                self._outputs.reach()
            elif self._objection not in {None, before}:
                self._tell(f"this run is not guarded: {self._objection}")
            self._ask_at = monotonic_ns() + ASK_AGAIN_EVERY
        return self._objection is None

    def _take_over(self, why: str) -> None:
        assert self._run is not None  # noqa: S101 -- there is a run while it is watched
        at, generation = monotonic_ns(), self._run.raise_generation()
        self._takeover = Takeover(at, self._run.writer, generation, why)
        self._failed = None
        self.phase = Phase.HOLDING

    def _hold(self, run: "_Run") -> None:
        failed = self._outputs.make_safe()
        if failed != self._failed:
            self._note(failed)
        if failed:
            return
        if run.has_ended:
            self.phase = Phase.WAITING
            run.close()
            self._run = None
        elif run.has_acknowledged:
            self._outputs.make_safe()  # a write that was under way is over by now
            self.phase = Phase.WATCHING
            self._tell("the run came back, disarmed")

    def _note(self, failed: list[str]) -> None:
        """Say how the takeover stands; only now, so that nothing comes before the outputs."""
        self._failed, takeover = failed, self._takeover
        takeover.failed = failed
        takeover.off_after_ns = None if failed else monotonic_ns() - takeover.at_ns
        self._tell(f"takeover {takeover.generation}: {takeover.text()}")
        with suppress(OSError):  # a full disk is no reason to stop watching
            self._record(takeover)


class _Run:
    """One run, as its statistics file and its process show it."""

    def __init__(self, path: Path) -> None:
        header, self._cells = STATISTICS.attach(path)
        self.writer = header["writer"]
        self.conditions: Mapping[str, Any] = header["conditions"]
        self.generation = 0
        self._process: int | None = None
        with suppress(OSError):
            self._process = os.pidfd_open(self.writer["pid"])
        if not is_running(self.writer):  # of another boot, or its number is another's by now
            self.close()

    @property
    def ends(self) -> list[int]:
        """A descriptor that becomes readable when the process ends, if it has not."""
        return [] if self._process is None else [self._process]

    @property
    def has_ended(self) -> bool:
        """Whether the process is gone."""
        if self._process is not None and select([self._process], (), (), 0)[0]:
            self.close()
        return self._process is None

    @property
    def has_acknowledged(self) -> bool:
        """Whether the run has seen the last takeover."""
        with suppress(StatisticsFileError):  # cut short: nothing can be seen in it any more
            return self._cells[ACKNOWLEDGED] == self._cells[GENERATION]
        return False

    def show_presence(self) -> None:
        """Let the run know that it is watched."""
        with suppress(StatisticsFileError):
            self._cells[GUARD] = monotonic_ns()

    def is_lost(self, stall: int) -> str:
        """Why outputs must be taken from it, empty if they need not."""
        if self.has_ended:
            return f"process {self.writer['pid']} has ended"
        try:
            heartbeat = self._cells[HEARTBEAT]
        except StatisticsFileError as error:
            return str(error)
        silent = monotonic_ns() - heartbeat
        if heartbeat > 0 and silent > stall:
            return f"no finished step for {silent / MILLISECOND:.0f} ms"
        return ""

    def raise_generation(self) -> int:
        """Withdraw the leave to move from the run; return the new generation."""
        with suppress(StatisticsFileError):
            self.generation = self._cells[GENERATION]
        self.generation += 1
        with suppress(StatisticsFileError):
            self._cells[GENERATION] = self.generation
        return self.generation

    def close(self) -> None:
        """Stop watching the process."""
        if self._process is not None:
            os.close(self._process)
            self._process = None
