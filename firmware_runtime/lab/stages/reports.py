"""Reports of one end of a stage to the process that started it.

A Unix socket pair of packets, inherited at the start. The end writes a few times a second, in slack
only, and never waits; what does not fit is left out. When the other side is closed, the process
that started this one has gone, and the run ends.
"""

import json
import signal
import socket
from collections.abc import Callable, Sequence
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.system.signals import STOPS

EVERY: Final = 200 * MILLISECOND
"""Ns of real time between two reports."""
RESERVE: Final = MILLISECOND // 4
GONE: Final = "the process that started this end has gone"


class EndReports:
    """A hook and a source of the run; `more` is what else a report says."""

    def __init__(
        self,
        executive: Executive,
        descriptor: int,
        shown: OutPort[float] | None,
        more: Callable[[], dict[str, object]],
    ) -> None:
        self._executive = executive
        self._socket = socket.socket(fileno=descriptor)
        self._socket.setblocking(False)
        self._name = None if shown is None else below_root(shown.path)
        self._value: float | None = None
        self._more = more
        self._due_at = 0
        self._longest = 0
        self._began = 0
        if shown is not None:
            executive.simulator.listen(shown, self._remember)
        executive.hooks.append(self)
        executive.add_source(self)

    def between_steps(self, now: int, left: int) -> None:
        """Report, if it is time to and there is time for it."""
        began = monotonic_ns()
        if began < self._due_at or left <= 2 * self._longest + RESERVE:
            return
        self._due_at = began + EVERY
        try:
            self._socket.send(json.dumps(self._report(now)).encode())
        except OSError:  # no room, or no reader: the end of the pair says so where it is read
            return
        self._longest = max(self._longest, monotonic_ns() - began)

    def fileno(self) -> int:
        """The descriptor that becomes readable when the other side is closed."""
        return self._socket.fileno()

    def receive(self) -> Sequence[tuple[InPort[object], object]]:
        """End the run if the other side was closed; there is nothing else to read."""
        try:
            has_gone = not self._socket.recv(1)
        except BlockingIOError:
            return ()
        except OSError:
            has_gone = True
        if has_gone:
            self._executive.request_stop(GONE)
        return ()

    @staticmethod
    def keep_signals_off() -> None:
        """From now on a request to end does not keep the result from being printed."""
        signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)

    def close(self) -> None:
        """Close this side."""
        self._socket.close()

    def _report(self, now: int) -> dict[str, object]:
        executive = self._executive
        return {
            "now_ns": now,
            "began_ns": self._began_at(),
            "shown": self._name,
            "value": self._value,
            "overruns": sum(account.overruns for account in executive.accounts),
            "faults": sum(counted.count for counted in executive.faults.counted),
            **self._more(),
        }

    def _began_at(self) -> int:
        """Instant 0 of the run by CLOCK_MONOTONIC; the two clocks are read one after the other.

        What passes in between makes it too early, so the latest that was found is the best.
        """
        self._began = max(self._began, monotonic_ns() - self._executive.clock.now())
        return self._began

    def _remember(self, _at: int, value: float) -> None:
        self._value = value
