"""How often this process was let go on after it had been stopped (SIGSTOP, Ctrl-Z, a debugger).

A stopped process neither runs nor waits for a processor, and no counter of the kernel says so. But
SIGCONT comes when it goes on, and may be handled. Handling it changes nothing else.
"""

import signal
import threading
from types import FrameType


class Continued:
    """`times` counts from the first `watch` on; None while it cannot be known."""

    def __init__(self) -> None:
        self.times: int | None = None

    def watch(self) -> None:
        """Count from now on; only the main thread may handle signals, elsewhere nothing changes.

        Another handler that is already there stays, and nothing is counted.
        """
        if threading.current_thread() is not threading.main_thread() or self.times is not None:
            return
        if signal.getsignal(signal.SIGCONT) is signal.SIG_DFL:
            self.times = 0
            signal.signal(signal.SIGCONT, self._note)

    def unwatch(self) -> None:
        """Leave the signal as it was."""
        if self.times is not None:
            self.times = None
            signal.signal(signal.SIGCONT, signal.SIG_DFL)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        if self.times is not None:
            self.times += 1


CONTINUED = Continued()
