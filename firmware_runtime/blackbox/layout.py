"""The layout of a recording: a prefix, then chunks, each of which can be read on its own.

    prefix   64 bytes: magic, size of a chunk, how many
    chunk    16 bytes: number from 1 in order of writing (0: empty), bytes used; then sections
    section  length, CRC-32 of what follows, the section's bytes

All numbers are little-endian. The first section of a chunk is the recording's header. In a run the
chunks are a ring in shared memory: the oldest is written over when all are full. `used` is stored
after the section it counts, so a process that is killed leaves whole sections.
"""

from struct import Struct
from typing import Final

MAGIC: Final = b"FWRTBOX2"
"""The last letter is the format's: another for each in which a recording is another's to read."""
PREFIX: Final = Struct("<8sII")
PREFIX_SIZE: Final = 64
CHUNK: Final = Struct("<QQ")
SECTION: Final = Struct("<II")
SMALLEST_CHUNK: Final = 128 * 1024
LARGEST_CHUNK: Final = 16 * 1024 * 1024
MOST_CHUNKS: Final = 4096


def prefix(chunk_size: int, chunks: int) -> bytes:
    """The first bytes of a recording."""
    return PREFIX.pack(MAGIC, chunk_size, chunks).ljust(PREFIX_SIZE, b"\0")
