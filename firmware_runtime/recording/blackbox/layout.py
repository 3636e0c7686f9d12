"""The layout of a recording: a prefix, then chunks, each of which can be read on its own.

    prefix   64 bytes: magic, size of a chunk, how many, where it stands, CRC-32 of these
    chunk    16 bytes: number from 1 in order of writing (0: empty), bytes used; then sections
    section  length, CRC-32 of what follows, the section's bytes
    spare    the prefix and the header's section again, behind the last chunk

All numbers are little-endian. The first section of a chunk is the recording's header. In a run the
chunks are a ring in shared memory: the oldest is written over when all are full. `used` is stored
after the section it counts, so a process that is killed leaves whole sections.
"""

from struct import Struct
from typing import Final
from zlib import crc32

MAGIC: Final = b"FWRTBOX7"
"""The last letter is the format's: another for each in which a recording is another's to read."""
PREFIX: Final = Struct("<8sII")
PREFIX_SIZE: Final = 64
_PLACE: Final = Struct("<Q")
_CHECK: Final = Struct("<I")
_CHECKED: Final = PREFIX.size + _PLACE.size
CHUNK: Final = Struct("<QQ")
SECTION: Final = Struct("<II")
SMALLEST_CHUNK: Final = 128 * 1024
LARGEST_CHUNK: Final = 16 * 1024 * 1024
MOST_CHUNKS: Final = 4096


def prefix(chunk_size: int, chunks: int, place: int = 0) -> bytes:
    """The first bytes of a recording, or those of its spare, which stands at `place`."""
    said = PREFIX.pack(MAGIC, chunk_size, chunks) + _PLACE.pack(place)
    return (said + _CHECK.pack(crc32(said))).ljust(PREFIX_SIZE, b"\0")


def is_whole(prefix: bytes) -> bool:
    """Whether the bytes are a prefix, none of them wrong; one of an older program has no check."""
    return prefix.startswith(MAGIC) and _is_checked(prefix)


def is_of_another_format(prefix: bytes) -> bool:
    """Whether the bytes are the prefix of another format's recording, none of them wrong."""
    is_other = prefix.startswith(MAGIC[:-1]) and not prefix.startswith(MAGIC)
    return is_other and _is_checked(prefix)


def _is_checked(prefix: bytes) -> bool:
    if len(prefix) < PREFIX_SIZE:
        return False
    said: int = _CHECK.unpack_from(prefix, _CHECKED)[0]
    return said == crc32(prefix[:_CHECKED])


def place_in(prefix: bytes) -> int:
    """Where a whole prefix says that it stands."""
    place: int = _PLACE.unpack_from(prefix, PREFIX.size)[0]
    return place
