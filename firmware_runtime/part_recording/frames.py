r"""The file of a recording: a magic number, then frames, each with its length and checksum.

    "FWRREC\r\n"    u32 length, u32 CRC-32, MessagePack of the header
                   u32 length, u32 CRC-32, MessagePack of a batch ...

Numbers are little-endian. A file that was cut off holds everything up to its last whole frame.
"""

from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import Final
from zlib import crc32

from firmware_runtime.recording.file_kind import PART_MAGIC

LARGEST: Final = 1 << 28
_FRONT: Final = Struct("<II")


def frame(content: bytes) -> bytes:
    """A frame around its content."""
    return _FRONT.pack(len(content), crc32(content)) + content


def frames_of(path: Path) -> Iterator[bytes | None]:
    """The content of each whole frame; a None at the end for a file that was cut off or damaged.

    Raises OSError.
    """
    with path.open("rb") as file:
        if file.read(len(PART_MAGIC)) != PART_MAGIC:
            return
        while front := file.read(_FRONT.size):
            if len(front) < _FRONT.size:
                yield None
                return
            length, checksum = _FRONT.unpack(front)
            content = file.read(length) if length <= LARGEST else b""
            if len(content) != length or crc32(content) != checksum:
                yield None
                return
            yield content
