"""What the machine, or a limit of the process, may have no more of."""

import errno
import os
from collections.abc import Mapping
from typing import Final

from firmware_runtime.errors import FirmwareRuntimeError

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
