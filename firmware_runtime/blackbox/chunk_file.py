"""A recording as a file of its own: chunks in order, each as long as it is used."""

from collections.abc import Sequence
from typing import NamedTuple
from zlib import crc32

from firmware_runtime.blackbox.layout import CHUNK, SECTION, prefix


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
    return b"".join((prefix(size, len(written)), *padded, last))


def _chunk(chunk: Numbered) -> bytes:
    sections = b"".join(SECTION.pack(len(each), crc32(each)) + each for each in chunk.contents)
    return CHUNK.pack(chunk.number, CHUNK.size + len(sections)) + sections
