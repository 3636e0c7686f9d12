"""Waiting for a signal, in verbs that go on until one comes."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from select import select
from types import FrameType

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
def until_signal(*more: signal.Signals) -> Iterator[UntilSignal]:
    """SIGINT, SIGTERM and SIGHUP, and `more`, end the waiting instead of the process.

    Then nothing halts the process either for writing to a terminal from the background.
    """
    waiting = UntilSignal()

    def handle(number: int, _frame: FrameType | None) -> None:
        waiting.stop(signal.Signals(number).name)

    with stop_on_signals(waiting.stop):
        before = {number: signal.signal(number, handle) for number in more}
        if more:
            before[signal.SIGTTOU] = signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        try:
            yield waiting
        finally:
            for number, handler in before.items():
                signal.signal(number, signal.SIG_DFL if handler is None else handler)
    waiting.close()
