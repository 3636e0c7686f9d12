"""What can be saved of a recording that was cut, or in which bytes are wrong.

A section has a checksum, so one that is whole is known wherever it stands. Each chunk begins with
the recording's header, and so does its spare: by these a file is read whose own beginning is lost.
A gap stays a gap: what follows it gets a chunk of its own, whose number leaves one out.

A chunk that does not say how much of it is used, or says it wrongly, is read on as long as its
sections go on in time: behind them may be those of the ring's lap before.
"""

import itertools
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from zlib import crc32

import msgspec

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    LARGEST_CHUNK,
    MOST_CHUNKS,
    PREFIX_SIZE,
    SECTION,
    Chunk,
    file_of,
    is_whole,
    parts_of,
    sizes_in,
    spare_in,
)
from firmware_runtime.recording.blackbox.reader import instants_in, kind_of
from firmware_runtime.recording.blackbox.ring_file import header_in
from firmware_runtime.recording.blackbox.section import Kind, decode

_HEADER_BEGINS: Final = bytes((0x9A, Kind.HEADER))
"""A MessagePack array of ten, whose first is the kind of section."""
_SECTION_BEGINS: Final = _HEADER_BEGINS[:1]
_IN_ORDER: Final = frozenset({Kind.BUILD, Kind.PROBE, Kind.STEP, Kind.KEYFRAME})
"""Kinds whose instants are not before that of the step before them."""
_MOST_PIECES: Final = MOST_CHUNKS // 2
"""Each of them is one chunk, and together they fill so many more."""
_BEFORE: Final = CHUNK.size + SECTION.size
"""Bytes of a chunk before its header's own."""


@dataclass(slots=True)
class Saved:
    """What was whole: `content` is a recording of it, `lost` says what was not, in parts."""

    content: bytes = field(repr=False)
    sections: int
    span: tuple[int, int]
    """First and last instant of the run in it, ns."""
    lost: list[str]


@dataclass(slots=True)
class _Piece:
    """Sections in a row of one chunk; `follows` is whether they follow the piece before it."""

    number: int
    contents: list[bytes]
    follows: bool
    is_cut: bool = False
    """Whether something is missing behind it."""

    @property
    def first_at(self) -> int:
        return next(instants_in(self.contents), 0)

    @property
    def is_from_start(self) -> bool:
        """Whether it has the beginning of the run."""
        return kind_of(self.contents[0]) == Kind.BUILD


def save(path: Path, content: bytes) -> Saved:
    """Save what is whole in the bytes of a file. Raises ConfigError where nothing is."""
    headers = list(_headers(content))
    if not headers:
        fault = "no header of a recording is whole in it, so nothing can be saved"
        raise ConfigError.of_one(str(path), fault, expected="a recording of a run")
    header = _section_at(content, headers[0] - SECTION.size, len(content)) or b""
    lost: list[str] = []
    pieces: list[_Piece] = []
    for begin, end in _chunks(content, headers, lost):
        pieces += _Reading(content, begin, end, lost).pieces(len(header))
    pieces = [each for each in pieces if each.contents]
    pieces.sort(key=lambda each: (each.first_at, each.number))
    del pieces[:-_MOST_PIECES]
    lost += _gaps(pieces)
    saved = [each for piece in pieces for each in piece.contents]
    instants = list(instants_in(saved)) or [0]
    chunks = list(_numbered(pieces, header)) or [Chunk(2, [header])]
    return Saved(file_of(chunks), len(saved), (min(instants), max(instants)), lost)


# Chunks -------------------------------------------------------------------------------------------


def _headers(content: bytes) -> Iterator[int]:
    """Where the header sections begin that are whole."""
    place = content.find(_HEADER_BEGINS)
    while place >= 0:
        section = _section_at(content, place - SECTION.size, len(content))
        if section is not None and header_in(section) is not None:
            yield place
        place = content.find(_HEADER_BEGINS, place + 1)


def _chunks(content: bytes, headers: list[int], lost: list[str]) -> Iterator[tuple[int, int]]:
    """Begin and end of each chunk: where a header is, and where one must have been."""
    spare = spare_in(content)
    end = len(content) if spare is None else spare.place
    begins = [each - _BEFORE for each in headers if each < end]
    origin, (stated, count) = 0, sizes_in(content[:PREFIX_SIZE])
    """How far all is from where it was written, and 0 if the file's own beginning is lost."""
    if spare is not None and not is_whole(content[:PREFIX_SIZE]):
        origin, (stated, count) = spare.shift, sizes_in(content[spare.place :])
    distances = (after - before for before, after in itertools.pairwise(begins))
    size = stated or min(distances, default=len(content))
    places = range(origin + PREFIX_SIZE, min(end, origin + PREFIX_SIZE + count * size), size)
    found = sorted({*begins, *_between(places, begins, size)})
    if found and found[0] > PREFIX_SIZE:
        lost.append(f"{found[0]} bytes before the first chunk")
    for begin, following in zip(found, [*found[1:], end], strict=True):
        yield begin, min(following, begin + size)


def _between(places: range, begins: list[int], size: int) -> Iterator[int]:
    """Places of chunks whose own header is not whole."""
    return (place for place in places if all(abs(place - begin) >= size for begin in begins))


# Sections -----------------------------------------------------------------------------------------


class _Reading:
    """One chunk, from `begin` to `end` at most; `lost` gets what is not whole in it."""

    def __init__(self, content: bytes, begin: int, end: int, lost: list[str]) -> None:
        self._content = content
        self._begin, self._end = begin, end
        self._lost = lost
        is_there = 0 <= begin <= len(content) - CHUNK.size
        self._number, used = CHUNK.unpack_from(content, begin) if is_there else (0, 0)
        self._is_sized = CHUNK.size < used <= LARGEST_CHUNK
        """Whether it says how much of it is used: behind that may be older sections."""
        self._used = begin + used if self._is_sized else begin
        self._is_cut = not self._is_sized or self._used > end
        self._latest = -1
        """The instant of the last step that was read."""

    def pieces(self, header: int) -> Iterator[_Piece]:
        """What is whole, behind a header of that length; nothing of a chunk not written yet."""
        if not self._content[max(0, self._begin) : self._end].strip(b"\0"):
            return
        if self._is_cut and self._is_sized:
            found, used = self._end - self._begin, self._used - self._begin
            self._lost.append(f"chunk {self._number} behind {found} of {used} bytes")
        elif self._is_cut:
            self._lost.append("number and length of a chunk")
        place = self._begin + _BEFORE + header
        piece = _Piece(self._number, [], follows=True)
        while place != self._used and place + SECTION.size <= self._end:
            section = self._read(place)
            if section is not None:
                piece.contents.append(section)
                place += SECTION.size + len(section)
                continue
            piece.is_cut = True
            yield piece
            after = self._next(place)
            if after is None and place < self._used <= self._end:
                after = self._used
            if after is not None:
                self._lost.append(self._in_words(place, after, piece))
            piece, place = _Piece(self._number, [], follows=False), after or self._end
        piece.is_cut = piece.is_cut or self._is_cut
        yield piece

    def _read(self, place: int) -> bytes | None:
        """The section there; None if it is not whole, or is one of the lap before."""
        section = _section_at(self._content, place, self._end)
        if section is None or (kind := kind_of(section)) not in _IN_ORDER:
            return section
        at = decode(section).at
        if place >= self._used and at < self._latest:
            return None
        self._latest = at if kind == Kind.STEP else self._latest
        return section

    def _next(self, place: int) -> int | None:
        """Where the next section begins that is whole; None if there is none."""
        content, end = self._content, self._end
        begins = content.find(_SECTION_BEGINS, place + 1 + SECTION.size, end)
        while begins >= 0:
            after = begins - SECTION.size
            if _section_at(content, after, end) is not None:
                return None if self._read(after) is None else after
            begins = content.find(_SECTION_BEGINS, begins + 1, end)
        return None

    def _in_words(self, place: int, after: int, piece: _Piece) -> str:
        section = _section_at(self._content, after, self._end)
        before = [*instants_in(piece.contents[-1:])]
        behind = [] if section is None else [*instants_in([section])]
        when = f" after {before[0] / SECOND:.3f} s" if before else ""
        until = f" before {behind[0] / SECOND:.3f} s" if behind else ""
        chunk = f"chunk {self._number}" if self._is_sized else "it"
        return f"{after - place} bytes of {chunk}{when}{until}"


def _section_at(content: bytes, place: int, end: int) -> bytes | None:
    """The section whose length and checksum stand there; None if there is none that is whole."""
    if place < 0 or place + SECTION.size > end:
        return None
    length, checksum = SECTION.unpack_from(content, place)
    begin = place + SECTION.size
    if length < 2 or begin + length > end or content[begin] != _SECTION_BEGINS[0]:
        return None
    section = content[begin : begin + length]
    if crc32(section) == checksum:
        with suppress(msgspec.MsgspecError):
            decode(section)
            return section
    return None


# What follows what --------------------------------------------------------------------------------


def _follows(before: _Piece, piece: _Piece) -> bool:
    return piece.follows and not before.is_cut and piece.number == before.number + 1


def _numbered(pieces: list[_Piece], header: bytes) -> Iterator[Chunk]:
    """Each piece as chunks. A gap before it leaves a number out."""
    number, room = 0, _room(pieces)
    for place, piece in enumerate(pieces):
        if place == 0:
            number = 1 if piece.is_from_start else 2
        else:
            number += 1 if _follows(pieces[place - 1], piece) else 2
        for part, contents in enumerate(parts_of(piece.contents, room)):
            number += 1 if part else 0
            yield Chunk(number, [header, *contents])


def _room(pieces: list[_Piece]) -> int:
    """Bytes of sections for each chunk, all of which are as long as the longest.

    One for each piece would be large where a few are long and many short; so long ones are parted.
    """
    lengths = [SECTION.size + len(each) for piece in pieces for each in piece.contents]
    return max(lengths, default=0) + sum(lengths) // max(1, len(pieces))


def _gaps(pieces: list[_Piece]) -> Iterator[str]:
    """Whole chunks that are missing."""
    numbered = [each for each in pieces if each.number > 0]
    for before, piece in itertools.pairwise(numbered):
        if 1 < piece.number - before.number < MOST_CHUNKS:
            yield f"chunks {before.number + 1} to {piece.number - 1}"
