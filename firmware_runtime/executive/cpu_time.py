"""Processor time of a run."""

from time import process_time_ns

from firmware_runtime.executive.clocks import Clock, MonotonicClock


class CpuTime:
    """Processor time of the run, without that of its pauses, ns.

    None passes on a clock that is not the machine's: in virtual time equal runs have equal
    statistics, whatever they cost.
    """

    def __init__(self, clock: Clock) -> None:
        self._now = process_time_ns if isinstance(clock, MonotonicClock) else _nothing
        self._began_with = self._now()
        self._paused_with: int | None = None

    def spent(self) -> int:
        """So far."""
        return self._now() - self._began_with

    def pause(self) -> None:
        """Count no more for a while."""
        self._paused_with = self._now()

    def go_on(self) -> None:
        """Count again after a pause, if there was one."""
        if self._paused_with is not None:
            self._began_with += self._now() - self._paused_with
            self._paused_with = None


def _nothing() -> int:
    return 0
