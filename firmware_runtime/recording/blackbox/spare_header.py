"""The second copy of a recording's prefix and header, behind its last chunk.

A run that has not filled its first chunk has one header in it; damage to that one costs no more
than the sections it touches. The prefix says where the copy stands, so that a file whose beginning
was cut off is known from one in which it is wrong.
"""

from zlib import crc32

from msgspec import Struct

from firmware_runtime.recording.blackbox.layout import (
    MAGIC,
    PREFIX_SIZE,
    SECTION,
    is_whole,
    place_in,
    prefix,
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
