"""A recording as a file of its own: chunks in order, each as long as it is used; then its spare."""

from collections.abc import Sequence
from typing import NamedTuple
from zlib import crc32

from firmware_runtime.blackbox.layout import CHUNK, PREFIX_SIZE, SECTION, prefix
from firmware_runtime.blackbox.reader import Recording
from firmware_runtime.blackbox.spare import spare_of


class Numbered(NamedTuple):
    """The sections of one chunk, its header first, and its number."""

    number: int
    contents: Sequence[bytes]


def file_of(chunks: Sequence[Numbered]) -> bytes:
    """The bytes of a recording of these chunks."""
    written = [_chunk(each) for each in chunks]
    size = max(map(len, written))
    *full, last = written
    padded = (each.ljust(size, b"\0") for each in full)
    end = PREFIX_SIZE + size * len(full) + len(last)
    spare = spare_of(size, len(written), end, chunks[0].contents[0])
    return b"".join((prefix(size, len(written)), *padded, last, spare))


def used_of(recording: Recording) -> bytes:
    """The bytes of a recording without the part of its memory that is not in use."""
    return file_of([Numbered(each.number, each.contents) for each in recording.chunks])


def _chunk(chunk: Numbered) -> bytes:
    sections = b"".join(SECTION.pack(len(each), crc32(each)) + each for each in chunk.contents)
    return CHUNK.pack(chunk.number, CHUNK.size + len(sections)) + sections
