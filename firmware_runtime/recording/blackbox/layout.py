"""The layout of a recording: a prefix, then chunks, each of which can be read on its own.

    prefix   64 bytes: magic, size of a chunk, how many, where it stands, CRC-32 of these
    chunk    16 bytes: number from 1 in order of writing (0: empty), bytes used; then sections
    section  length, CRC-32 of what follows, the section's bytes
    spare    the prefix and the header's section again, behind the last chunk

All numbers are little-endian. The first section of a chunk is the recording's header. In a run the
chunks are a ring in shared memory: the oldest is written over when all are full. `used` is stored
after the section it counts, so a process that is killed leaves whole sections.

Its size follows from so many minutes of a board, by what it asks of its buses: an estimate, for a
model that computes alone is not seen in it.

Behind the last chunk is a second copy of prefix and header. A run that has not filled its first
chunk has one header in it; damage to that one costs no more than the sections it touches. The
prefix says where the copy stands, so that a file whose beginning was cut off is known from one in
which it is wrong.
"""

import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from typing import Final
from zlib import crc32

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.budget import BusLoad, wire_bytes

MAGIC: Final = b"FWRTBOX7"
"""The last letter is the format's: another for each in which a recording is another's to read."""
PREFIX: Final = struct.Struct("<8sII")
PREFIX_SIZE: Final = 64
_PLACE: Final = struct.Struct("<Q")
_CHECK: Final = struct.Struct("<I")
_CHECKED: Final = PREFIX.size + _PLACE.size
CHUNK: Final = struct.Struct("<QQ")
SECTION: Final = struct.Struct("<II")
SMALLEST_CHUNK: Final = 128 * 1024
LARGEST_CHUNK: Final = 16 * 1024 * 1024
MOST_CHUNKS: Final = 4096


def prefix(chunk_size: int, chunks: int, place: int = 0) -> bytes:
    """The first bytes of a recording, or those of its spare, which stands at `place`."""
    said = PREFIX.pack(MAGIC, chunk_size, chunks) + _PLACE.pack(place)
    return (said + _CHECK.pack(crc32(said))).ljust(PREFIX_SIZE, b"\0")


def sizes_in(prefix: bytes) -> tuple[int, int]:
    """Bytes of a chunk, and how many chunks; 0 where a file does not begin as a recording does."""
    if len(prefix) < PREFIX_SIZE or prefix[: len(MAGIC)] != MAGIC:
        return 0, 0
    size, count = map(int, PREFIX.unpack_from(prefix)[1:])
    is_sensible = CHUNK.size < size <= LARGEST_CHUNK and 0 < count <= MOST_CHUNKS
    return (size, count) if is_sensible else (0, 0)


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


BYTES_PER_TRANSACTION: Final = 250
"""What comes with a transaction, beside its own bytes."""
BYTES_PER_SECOND: Final = 8_000
"""What comes without any: keyframes, and models that touch no bus."""
LEAST: Final = 2 << 20
MOST: Final = 256 << 20
MOST_OF_MEMORY: Final = 1 / 16
"""The share of the machine's memory that one recording may take."""
CHUNKS: Final = 32


class Size(Struct, frozen=True):
    """The chunks of a recording."""

    chunk_bytes: int
    chunks: int

    @property
    def bytes(self) -> int:
        """The whole file."""
        return PREFIX_SIZE + self.chunk_bytes * self.chunks


def most() -> int:
    """Bytes of a recording on this machine at most."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return min(max(round(memory * MOST_OF_MEMORY), LEAST), MOST)


def size_for(loads: Iterable[BusLoad], minutes: float) -> Size:
    """Room for so many minutes, from 2 to 256 MiB, or to what this machine's memory allows."""
    wanted = min(max(round(bytes_per_second(loads) * 60 * minutes), LEAST), most())
    chunk = min(max(-(-wanted // CHUNKS), SMALLEST_CHUNK), LARGEST_CHUNK)
    return Size(chunk, -(-wanted // chunk) + 1)  # the oldest is given up while another is begun


def seconds_held(loads: Iterable[BusLoad], minutes: float) -> float:
    """How much of a run is in it, s: what was asked for, or less where that takes too much."""
    loads = list(loads)
    return min(minutes * 60, most() / bytes_per_second(loads))


def bytes_per_second(loads: Iterable[BusLoad]) -> float:
    """What these buses bring."""
    return BYTES_PER_SECOND + sum(
        (wire_bytes(each.messages) + BYTES_PER_TRANSACTION) * SECOND / each.period_ns
        for load in loads
        for each in load.transactions
    )


class Spare(Struct, frozen=True):
    """Where the copy stands in some bytes, and how far that is from where it was written."""

    place: int
    shift: int


def spare_of(chunk_size: int, chunks: int, place: int, header: bytes) -> bytes:
    """The bytes of the copy, which is to stand at `place`."""
    section = SECTION.pack(len(header), crc32(header))
    return prefix(chunk_size, chunks, place) + section + header


def spare_in(content: bytes) -> Spare | None:
    """The last whole copy of a prefix that has a section behind it; None if there is none."""
    place = content.rfind(MAGIC)
    while place > 0:
        said = content[place : place + PREFIX_SIZE]
        if is_whole(said) and place_in(said) > 0:
            return Spare(place, place - place_in(said))
        place = content.rfind(MAGIC, 0, place)
    return None


class Chunk(Struct, frozen=True):
    """One chunk, copied: its number and sections; `damage` says what is wrong at its end."""

    number: int
    contents: list[bytes]
    """Its header first."""
    damage: str | None = None


def file_of(chunks: Sequence[Chunk]) -> bytes:
    """The bytes of a recording of these chunks, each as long as it is used."""
    size = max(map(_size, chunks))
    file = BytesIO()  # whose bytes are not copied at the end
    file.write(prefix(size, len(chunks)))
    for place, chunk in enumerate(chunks):
        file.seek(PREFIX_SIZE + size * place)
        file.write(CHUNK.pack(chunk.number, _size(chunk)))
        for each in chunk.contents:
            file.write(SECTION.pack(len(each), crc32(each)))
            file.write(each)
    file.write(spare_of(size, len(chunks), file.tell(), chunks[0].contents[0]))
    return file.getvalue()


def _size(chunk: Chunk) -> int:
    return CHUNK.size + sum(SECTION.size + len(each) for each in chunk.contents)


def sections_in(content: bytes, used: int) -> Iterator[tuple[bytes, int]]:
    """Yield the sections in so many bytes of a chunk, with their checksums; the last may be cut."""
    place = CHUNK.size
    while place + SECTION.size <= used:
        length, checksum = SECTION.unpack_from(content, place)
        place += SECTION.size
        yield content[place : min(place + length, used)], checksum
        place += length


def parts_of(contents: Iterable[bytes], room: int) -> Iterator[list[bytes]]:
    """Sections in rows that take no more than so many bytes in a chunk."""
    part: list[bytes] = []
    used = 0
    for content in contents:
        if used + SECTION.size + len(content) > room and part:
            yield part
            part, used = [], 0
        part.append(content)
        used += SECTION.size + len(content)
    yield part
