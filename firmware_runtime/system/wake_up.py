"""A pipe to oneself, by which threads and signal handlers end another thread's wait."""

import os
from contextlib import suppress

from firmware_runtime.system.resources import Closing

_ALL = 1 << 16
"""Bytes that a pipe holds at most."""


class WakeUp(Closing):
    """Readable from a ring on, until it is cleared."""

    def __init__(self) -> None:
        self._read, self._write = os.pipe()
        for each in (self._read, self._write):
            os.set_blocking(each, False)

    def ring(self) -> None:
        """Make it readable; safe in a signal handler and in any thread."""
        with suppress(BlockingIOError):  # full: it is readable
            os.write(self._write, b"\0")

    def clear(self) -> None:
        """Let it be readable no more, until it rings again."""
        with suppress(BlockingIOError):  # nothing rang
            os.read(self._read, _ALL)

    def fileno(self) -> int:
        """The descriptor."""
        return self._read

    def close(self) -> None:
        """Release the descriptors."""
        os.close(self._read)
        os.close(self._write)
