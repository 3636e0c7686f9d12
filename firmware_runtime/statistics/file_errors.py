"""What can be wrong with a file that a run keeps."""

import errno
from typing import Final

from firmware_runtime.errors import FirmwareRuntimeError

OF_THE_MACHINE: Final = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ENOMEM, errno.EMFILE, errno.ENFILE}
)
"""Numbers of errors that say how the machine is, and not what was asked of it."""
ROOM_EXPECTED: Final = "expected a disk with room that is writable"


class StatisticsFileError(FirmwareRuntimeError):
    """A statistics file is absent, not ours, of another version, damaged, or cannot be made."""


class NoRoomError(StatisticsFileError):
    """A file cannot be made as the machine is now: its disk is full, read-only or fails.

    That is no bad input, and may be over when the service tries again.
    """


class BeingWrittenError(StatisticsFileError):
    """A living writer keeps a file half written: it is stopped there, or never pauses."""


class TraceFileError(FirmwareRuntimeError):
    """A trace cannot be written to the requested place."""


class TraceNotWholeError(TraceFileError):
    """A trace lacks something, as where the disk is full; the run went on to its end."""


def in_words(error: Exception) -> str:
    """What msgspec says of a value, its place first: ``run.steps: expected `int`, got `str` ``."""
    fault, _, place = str(error).partition(" - at ")
    place = place.strip("`").removeprefix("$").removeprefix(".")
    fault = fault[:1].lower() + fault[1:]
    return f"{place}: {fault}" if place else fault
