"""Chunks: sections in a row behind a header; and a recording of them as a file, with its spare."""

from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from zlib import crc32

from msgspec import Struct

from firmware_runtime.recording.blackbox.layout import CHUNK, PREFIX_SIZE, SECTION, prefix, spare_of


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
