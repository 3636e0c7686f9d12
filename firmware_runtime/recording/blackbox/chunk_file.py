"""A recording as a file of its own: chunks in order, each as long as it is used; then its spare."""

from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from typing import NamedTuple
from zlib import crc32

from firmware_runtime.recording.blackbox.layout import CHUNK, PREFIX_SIZE, SECTION, prefix, spare_of
from firmware_runtime.recording.blackbox.reader import Recording


class Numbered(NamedTuple):
    """The sections of one chunk, its header first, and its number."""

    number: int
    contents: Sequence[bytes]


def file_of(chunks: Sequence[Numbered]) -> bytes:
    """The bytes of a recording of these chunks."""
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


def _size(chunk: Numbered) -> int:
    return CHUNK.size + sum(SECTION.size + len(each) for each in chunk.contents)


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


def used_of(recording: Recording) -> bytes:
    """The bytes of a recording without the part of its memory that is not in use."""
    return file_of([Numbered(each.number, each.contents) for each in recording.chunks])
