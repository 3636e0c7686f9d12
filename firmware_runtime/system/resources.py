"""Resources: closed at the end of a block, awaited while others have them, or run out of.

One of them is the pipe to oneself by which threads and signal handlers end another's wait.
"""

import errno
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import suppress
from time import monotonic, sleep
from types import TracebackType
from typing import Final, Self, TypeVar

from firmware_runtime.errors import FirmwareRuntimeError


class Closing(ABC):
    """A context manager that closes itself, however the block ends."""

    @abstractmethod
    def close(self) -> object:
        """Give back what is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


_PIPE = 1 << 16
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
            os.read(self._read, _PIPE)

    def fileno(self) -> int:
        """The descriptor."""
        return self._read

    def close(self) -> None:
        """Release the descriptors."""
        os.close(self._read)
        os.close(self._write)


T = TypeVar("T")

PAUSE_S: Final = 0.02
"""Between two attempts."""


def tried_again(take: Callable[[], T], errors: tuple[type[Exception], ...], within_s: float) -> T:
    """Return what `take` does; where it raises one of `errors`, try again for `within_s` seconds.

    Raises the error of the last attempt, and at once any other.
    """
    give_up_at = monotonic() + within_s
    while True:
        try:
            return take()
        except errors:
            if monotonic() >= give_up_at:
                raise
        sleep(PAUSE_S)


_EXPECTED: Final[Mapping[int, str]] = {
    errno.EMFILE: "a higher limit of open files (`ulimit -n`)",
    errno.ENFILE: "fewer files open on this machine",
    errno.ENOMEM: "more, or a higher limit (`ulimit -v`)",
    errno.ENOSPC: "room there",
}
_NO_FOLDER: Final = "No usable temporary directory"
"""What `tempfile` begins with, whatever kept it from writing a file to any."""


def ran_out_of(error: MemoryError | OSError) -> FirmwareRuntimeError:
    """Put it into a sentence. Raises the error again where it is about something else."""
    number = errno.ENOMEM if isinstance(error, MemoryError) else error.errno
    said = getattr(error, "strerror", None)
    if number == errno.ENOENT and said is not None and said.startswith(_NO_FOLDER):
        expected = "one with room, that may be written, and a descriptor left (`ulimit -n`)"
        return FirmwareRuntimeError(said, expected=expected)
    if number is None or number not in _EXPECTED:
        raise error
    place = getattr(error, "filename", None)
    where = "" if place is None else f"{place}: "
    return FirmwareRuntimeError(f"{where}{os.strerror(number)}", expected=_EXPECTED[number])
