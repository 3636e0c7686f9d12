"""Terminal and standard output: a line of progress that never makes it wait, and lost output.

Output that goes nowhere: without a reader, as in `... | head`, or that finds no room. A reader who
has gone is no reason to fail, or to succeed. What was asked for and could not be printed for
another reason, such as a full disk, is one sentence and a status of its own.
"""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from time import monotonic
from typing import Any, TextIO, cast

from firmware_runtime.system.messages import Sentences
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


def is_same_place(one: TextIO | None, other: TextIO | None) -> bool:
    """Return whether two streams end at the same terminal, pipe or file: a reader sees both."""
    if one is None or other is None:
        return False
    with suppress(OSError, ValueError):  # in memory, or closed
        return os.path.samestat(os.fstat(one.fileno()), os.fstat(other.fileno()))
    return False


class OutputError(OSError):
    """Standard output takes no more: a full disk, a device that failed; not a reader who left."""


class _Checked:
    """Standard output whose failures differ from those of any other file."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 -- whatever streams have
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with _as_output_error():
            return self._stream.write(text)

    def flush(self) -> None:
        with _as_output_error():
            self._stream.flush()


@contextmanager
def _as_output_error() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(error.errno, error.strerror) from error


@contextmanager
def output_checked() -> Iterator[None]:
    """Within the block, printing to standard output that takes no more raises OutputError.

    A character that its encoding does not have is printed as on standard error: escaped.
    """
    before = sys.stdout
    if before is None:
        yield
        return
    errors = before.errors
    if isinstance(before, TextIOWrapper):
        before.reconfigure(errors="backslashreplace")
    sys.stdout = cast("TextIO", _Checked(before))
    try:
        yield
    finally:
        sys.stdout = before
        if isinstance(before, TextIOWrapper):
            before.reconfigure(errors=errors)


def not_printed(error: OutputError) -> None:
    """Say so, and let nothing that is printed afterwards fail."""
    print_line(
        f"firmware-runtime: standard output: {error.strerror}; expected room for all of it",
        sys.stderr,
    )
    _print_nowhere((sys.stdout,))


@contextmanager
def readers_may_go() -> Iterator[None]:
    """Within the block, printing ends early once its reader has gone; nothing else changes.

    What is printed afterwards, also when the interpreter ends, goes nowhere.
    """
    try:
        yield
        if sys.stdout is not None:  # closed by the process that started this one
            sys.stdout.flush()
    except BrokenPipeError:
        _print_nowhere((sys.stdout, sys.stderr))


def _print_nowhere(streams: Iterable[TextIO | None]) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in filter(None, streams):
        os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def print_line(what: str, stream: TextIO | None) -> None:
    """Print one line without waiting: no reader, a slow one or a full disk is no reason to stop."""
    printed = Sentences(stream)
    printed.say(what)
    printed.close()
