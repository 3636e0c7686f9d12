"""Waiting for a signal, in verbs that go on until one comes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from select import select

from firmware_runtime.system.signals import stop_on_signals


class UntilSignal:
    """Within `until_signal`: `came` is whether one has, `wait` waits for it."""

    def __init__(self) -> None:
        self.came = False
        self.name = ""
        """The signal that came last, such as SIGINT."""
        self._wake_up = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)

    def fileno(self) -> int:
        """The descriptor that becomes readable when a signal has come."""
        return self._wake_up

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait, for so long at most; return whether a signal has come."""
        select([self], (), (), timeout_s)
        return self.came

    def stop(self, name: str) -> None:
        """A signal has come."""
        self.came = True
        self.name = name
        os.eventfd_write(self._wake_up, 1)

    def close(self) -> None:
        """Release the descriptor."""
        os.close(self._wake_up)


@contextmanager
def until_signal(*, is_driving: bool = False) -> Iterator[UntilSignal]:
    """Within the block a signal that would end this process ends the waiting.

    `is_driving` as for `stop_on_signals`.
    """
    waiting = UntilSignal()
    with stop_on_signals(waiting.stop, is_driving=is_driving):
        yield waiting
    waiting.close()
