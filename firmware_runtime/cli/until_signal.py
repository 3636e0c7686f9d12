"""Waiting for a signal, in verbs that go on until one comes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from select import select

from firmware_runtime.executive.signals import stop_on_signals


class UntilSignal:
    """Within `until_signal`: `came` tells whether one has, `wait` waits for it."""

    def __init__(self) -> None:
        self.came = False
        self._wake_up = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)

    def fileno(self) -> int:
        """The descriptor that becomes readable when a signal has come."""
        return self._wake_up

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait, for so long at most; return whether a signal has come."""
        select([self], (), (), timeout_s)
        return self.came

    def stop(self, _signal: str) -> None:
        """A signal has come."""
        self.came = True
        os.eventfd_write(self._wake_up, 1)

    def close(self) -> None:
        """Release the descriptor."""
        os.close(self._wake_up)


@contextmanager
def until_signal() -> Iterator[UntilSignal]:
    """SIGINT, SIGTERM and SIGHUP end the waiting instead of the process."""
    waiting = UntilSignal()
    with stop_on_signals(waiting.stop):
        yield waiting
    waiting.close()
