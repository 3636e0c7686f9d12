"""How a long run goes, on one line of a terminal: time, the shown value, overruns, faults.

It is a hook of the loop: it writes in slack only, a few times a second, and never waits.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic_ns

from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.number_formats import count
from firmware_runtime.system.messages import Sentences
from firmware_runtime.system.terminal import OwnTerminal

EVERY = 250 * MILLISECOND
"""Ns of real time between two lines."""
RESERVE = MILLISECOND // 4


class ProgressLine:
    """Shows a run up to `until`; `shown` is the port whose last value is shown, if any."""

    def __init__(
        self,
        executive: Executive,
        terminal: OwnTerminal,
        until: int,
        shown: OutPort[float] | None,
        real_time: Callable[[], int] = monotonic_ns,
    ) -> None:
        self._executive = executive
        self._terminal = terminal
        self._span = "" if until == NEVER else f" of {until / SECOND:g}"
        self._name = "" if shown is None else shown.name
        self._value: float | None = None
        self._real_time = real_time
        self._due_at = real_time() + EVERY
        self._longest = 0
        if shown is not None:
            executive.simulator.listen(shown, self._remember)
        executive.hooks.append(self)

    def between_steps(self, now: int, left: int) -> None:
        """Write the line, if it is time to and there is time for it."""
        began = self._real_time()
        if began < self._due_at or left <= 2 * self._longest + RESERVE:
            return
        self._due_at = began + EVERY
        self._terminal.show(self._line(now))
        self._longest = max(self._longest, self._real_time() - began)

    def _line(self, now: int) -> str:
        at = self._executive.simulator.now if now == NEVER else now
        words = [f"{at / SECOND:.1f}{self._span} s"]
        if self._value is not None:
            words.append(f"{self._name} {self._value:.4g}")
        overruns = sum(account.overruns for account in self._executive.accounts)
        faults = sum(counted.count for counted in self._executive.faults.counted)
        words += [count(overruns, "overrun"), count(faults, "fault")]
        return "  ".join(words)

    def _remember(self, _at: int, value: float) -> None:
        self._value = value


class Messages:
    """Sentences for standard error while a run lasts, none of which waits for a reader.

    The line of progress makes room for them.
    """

    def __init__(self) -> None:
        self.terminal: OwnTerminal | None = None
        self._errors = Sentences(sys.stderr)

    def __call__(self, what: str) -> None:
        """Print one."""
        if self.terminal is not None:
            self.terminal.clear()
        self._errors.say(f"firmware-runtime: {what}")


@contextmanager
def progress_shown(
    session: Session, until: int, messages: Messages, *, wanted: bool
) -> Iterator[None]:
    """Show how the run goes while the block lasts, if standard output is a terminal."""
    terminal = OwnTerminal.of(sys.stdout) if wanted else None
    if terminal is None:
        yield
        return
    ProgressLine(session.executive, terminal, until, session.shown)
    messages.terminal = terminal
    try:
        yield
    finally:
        messages.terminal = None
        terminal.close()
