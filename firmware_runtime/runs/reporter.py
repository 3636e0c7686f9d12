"""Reporter to systemd and the journal: a hook, quiet unless something happened.

- READY after the first step, when devices have answered. From then on the watchdog is fed by the
  loop itself, between two steps, as long as logical time keeps up, and by nothing else; before it
  there is none, since the first sign of life would begin it.
- STATUS, once a second where there is time: the one-line summary.
- The journal: a line for each episode of overruns when it is over, or the run is, one for each kind
  of fault, repeated only with its number (`fault_journal`), and a summary a minute, which a loop
  that never has time writes all the same.
"""

from collections.abc import Callable

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.fault_log import CountedFault, FaultLog
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.system.messages import WARNING, Journal, Notices

STATUS_EVERY = SECOND
SUMMARY_EVERY = 60 * SECOND
RESERVE = MILLISECOND
REPORT_EVERY = SECOND
"""Ns from one line about episodes of a model to the next: a loop that is always late has hundreds
in a second, and writing them takes the time that it lacks."""
TIMEOUT = SECOND
"""Ns after which a summary for the journal is made all the same: a fast loop never has the time."""


class Reporter:
    """Reports a run; `summary` makes the one line of its statistics."""

    def __init__(
        self,
        executive: Executive,
        notices: Notices,
        journal: Journal,
        summary: Callable[[Figures], str],
    ) -> None:
        self._executive = executive
        self._notices = notices
        self._journal = journal
        self._summary = summary
        self._is_ready = False
        self._reported = dict.fromkeys(executive.accounts, 0)
        self._report_at = dict.fromkeys(executive.accounts, 0)
        self._status_at = 0
        self._summary_at = SUMMARY_EVERY
        self._longest = 0
        self._faults = FaultJournal(executive.faults, journal)
        executive.hooks.append(self)

    def between_steps(self, now: int, left: int) -> None:
        """Write what is due: notices, faults, episodes that are over, the status."""
        if not self._is_ready and self._executive.cells[STEPS] > 0:
            self._is_ready = True
            self._notices.ready()
        if self._is_ready and self._executive.progress.keeps_up:
            self._notices.alive()
        self._faults.write_due(now)
        for account, reported in self._reported.items():
            is_over = account.episodes > reported and not account.in_episode
            if is_over and now >= self._report_at[account]:
                self._report_at[account] = now + REPORT_EVERY
                self._report(account)
        has_time = now >= self._status_at and left > 2 * self._longest + RESERVE
        if has_time or now >= self._summary_at + TIMEOUT:
            self._status_at = now + STATUS_EVERY
            self._show_status(now)

    def close(self) -> None:
        """Write the episodes that the end of the run has cut short, and the last faults."""
        self._faults.close()
        for account, reported in self._reported.items():
            if account.episodes > reported:
                self._report(account)

    def _report(self, account: ModelAccount) -> None:
        """One line for an episode that is over, and for those that came too fast before it."""
        episodes = account.episodes - self._reported[account]
        self._reported[account] = account.episodes
        late_us, missed = account.latest_in_episode // MICROSECOND, account.missed_in_episode
        cause, period_us = account.cause or "unknown", account.period // MICROSECOND
        is_periodic = account.period != NEVER
        period = f", period {period_us} us" if is_periodic else ""
        self._journal.write(
            f"{account.path}: {late_us} us late, {missed} missed{period}: {cause}"
            + (f"; the last of {episodes} episodes" if episodes > 1 else ""),
            WARNING,
            MODEL=account.path,
            LATE_US=late_us,
            MISSED=missed,
            CAUSE=cause,
            EPISODES=episodes,
            **({"PERIOD_US": period_us} if is_periodic else {}),
        )

    def _show_status(self, now: int) -> None:
        """The summary, for `systemctl status`; once a minute for the journal too."""
        line = self._summary(self._executive.statistics.figures())
        self._notices.status(line)
        if now >= self._summary_at:
            self._summary_at = now + SUMMARY_EVERY
            self._journal.write(line)
        self._longest = max(self._longest, self._executive.clock.now() - now)


AGAIN_AFTER = 10 * SECOND
"""Ns from one line on a kind of fault of a model to the next."""


class _Kind:
    """One kind of fault of one model, and how much of it has been written."""

    def __init__(self, counted: CountedFault) -> None:
        self.counted = counted
        self.written = 0
        self.again_at = 0


class FaultJournal:
    """Writes what a run's fault log counts."""

    def __init__(self, faults: FaultLog, journal: Journal) -> None:
        self._counted = faults.counted
        self._journal = journal
        self._kinds: list[_Kind] = []

    def write_due(self, now: int) -> None:
        """Write what is new, as far as its time has come."""
        if len(self._kinds) < len(self._counted):
            self._kinds += map(_Kind, self._counted[len(self._kinds) :])
        for kind in self._kinds:
            if kind.written < kind.counted.count and now >= kind.again_at:
                kind.again_at = now + AGAIN_AFTER
                self._write(kind)

    def close(self) -> None:
        """Write what is new, whenever its time would come."""
        self.write_due(NEVER)

    def _write(self, kind: _Kind) -> None:
        counted = kind.counted
        new, kind.written = counted.count - kind.written, counted.count
        many = "" if new == 1 else f" ({new} times since the last line)"
        self._journal.write(
            f"{counted.path}: {counted.kind}: {counted.sentence}{many}",
            WARNING,
            MODEL=counted.path,
            FAULT=counted.kind,
            COUNT=counted.count,
        )
