"""One line of a terminal that says how far something is, and never makes it wait."""

import os
from contextlib import suppress
from time import monotonic
from typing import TextIO

from firmware_runtime.system.resources import Closing


class OwnTerminal:
    """One line of a terminal that is written over again; what finds no room is left out."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._shown = 0

    @classmethod
    def of(cls, stream: TextIO | None) -> "OwnTerminal | None":
        """The terminal of a stream; None for a pipe, a file, or a stream that is closed."""
        if stream is None or stream.closed or not stream.isatty():
            return None
        flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        with suppress(OSError):
            return cls(os.open(os.ttyname(stream.fileno()), flags))
        return None

    def show(self, line: str) -> None:
        """Write a line over the last one; not from the background, which would stop the process."""
        with suppress(OSError):
            if os.tcgetpgrp(self._descriptor) == os.getpgrp():
                columns = os.get_terminal_size(self._descriptor).columns or 80
                line = line[: columns - 1]
                text = f"{line:{self._shown}}\r".encode()
                if os.write(self._descriptor, text) == len(text):
                    self._shown = len(line)

    def clear(self) -> None:
        """Take the line away."""
        if self._shown:
            self.show("")

    def close(self) -> None:
        """Take the line away and let the terminal go."""
        self.clear()
        os.close(self._descriptor)


class Progress(Closing):
    """How far a command is, on the terminal of a stream; nothing where that is none."""

    def __init__(self, stream: TextIO | None, *, wanted: bool = True, every_s: float = 0.0) -> None:
        self._terminal = OwnTerminal.of(stream) if wanted else None
        self._every_s = every_s
        self._due_at = monotonic() + every_s

    @property
    def is_shown(self) -> bool:
        """Whether there is a terminal."""
        return self._terminal is not None

    def show(self, line: str) -> None:
        """Write a line over the last one, if it is time to."""
        if self._terminal is not None and (now := monotonic()) >= self._due_at:
            self._due_at = now + self._every_s
            self._terminal.show(line)

    def close(self) -> None:
        """Leave no trace of it."""
        if self._terminal is not None:
            self._terminal.close()
