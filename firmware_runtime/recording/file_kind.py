"""What kind of recording a file is, by its first bytes."""

from pathlib import Path
from typing import Final

PART_MAGIC: Final = b"FWRREC\r\n"
"""With which a recording of a part begins; that of a run has `blackbox.layout.MAGIC`."""


def is_of_part(path: Path) -> bool:
    """Whether a file begins as one of `run --record` does."""
    return begins_with(path, PART_MAGIC)


def begins_with(path: Path, magic: bytes) -> bool:
    """Whether it is a regular file that begins so; False where it cannot be read."""
    try:
        if not path.is_file():  # a device is not even opened, a pipe not waited for
            return False
        with path.open("rb") as file:
            return file.read(len(magic)) == magic
    except (OSError, ValueError):
        return False
