"""One line of a terminal that says how far something is, and never makes it wait."""

import os
from contextlib import suppress
from typing import TextIO


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
