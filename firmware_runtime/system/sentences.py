"""Sentences for people, printed without waiting: a reader that does not read holds up nothing.

A full pipe, a terminal stopped by Ctrl-S and a journal that hangs all make a plain `print` wait.
The stream is shared with other processes, a shell's terminal with all that run in it, so its
O_NONBLOCK flag is left as it is. Instead

- a socket, such as the journal's, is sent to with MSG_DONTWAIT;
- a pipe or a terminal is opened once more, through /proc/self/fd, without blocking; where that is
  refused, it is written to only while poll(2) reports room, and no more than fits then;
- a file is written to.

What does not fit is dropped and counted. The next sentence that fits is preceded by the count.
"""

import os
import stat
from collections.abc import Callable
from contextlib import ExitStack, suppress
from select import PIPE_BUF, POLLOUT, poll
from typing import TextIO, TypeAlias

_Write: TypeAlias = Callable[[bytes], int]
"""Writes without waiting; returns how many bytes were taken, or raises OSError."""


class Sentences:
    """Prints to one stream, never waits and never fails. Not for several threads.

    A stream without a descriptor, such as one in memory, is written to as usual.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self.dropped = 0
        """Sentences that found no room, since the last that did."""
        self._rest = b""
        self._opened = ExitStack()
        self._write = self._nowhere if stream is None else self._writer(stream)

    def say(self, sentence: str) -> None:
        """Print a line, or drop it."""
        line = f"{sentence}\n"
        if self.dropped:
            line = f"({self.dropped} dropped: no room for them)\n{line}"
        if self._is_begun(line.encode(errors="backslashreplace")):
            self.dropped = 0
        else:
            self.dropped += 1

    def close(self) -> None:
        """Release what was opened; what is printed afterwards is dropped."""
        self._write = self._nowhere
        self._opened.close()

    def _is_begun(self, line: bytes) -> bool:
        """Write as much as fits; a line that was begun goes on before the next one."""
        data = self._rest + line
        written = 0
        with suppress(OSError, ValueError):  # no room, no reader, a full disk, a closed stream
            written = self._write(data)
        begun = written > len(self._rest)
        self._rest = data[written:] if begun else self._rest[written:]
        return begun

    def _writer(self, stream: TextIO) -> _Write:
        """What writes to this kind of stream without waiting."""
        try:
            descriptor = stream.fileno()
            mode = os.fstat(descriptor).st_mode
        except (OSError, ValueError):
            return lambda data: _write_text(stream, data)
        if stat.S_ISSOCK(mode):
            import socket  # noqa: PLC0415 -- takes longer to load than all of this

            end = self._opened.enter_context(socket.socket(fileno=os.dup(descriptor)))
            return lambda data: end.send(data, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        if stat.S_ISREG(mode):
            return lambda data: os.write(descriptor, data)
        flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
        with suppress(OSError):
            own = os.open(f"/proc/self/fd/{descriptor}", flags)
            self._opened.callback(os.close, own)
            return lambda data: os.write(own, data)
        return lambda data: _write_what_fits(descriptor, data)

    @staticmethod
    def _nowhere(_data: bytes) -> int:
        return 0


def _write_text(stream: TextIO, data: bytes) -> int:
    stream.write(data.decode())
    stream.flush()
    return len(data)


def _write_what_fits(descriptor: int, data: bytes) -> int:
    room = poll()
    room.register(descriptor, POLLOUT)
    if not any(event & POLLOUT for _, event in room.poll(0)):
        return 0
    return os.write(descriptor, data[:PIPE_BUF])
