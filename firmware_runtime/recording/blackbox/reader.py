"""Reading a recording: its header, its sections in order, and what is wrong with the file.

A file is taken for what is whole in it. A section whose CRC-32 is wrong ends its chunk, a chunk
that is missing between two leaves a gap; both are said, and what follows begins at a keyframe.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final
from zlib import crc32

import msgspec
from msgspec import Struct

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.file_content import Content, content_of, opened_content
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    LARGEST_CHUNK,
    MAGIC,
    MOST_CHUNKS,
    PREFIX,
    PREFIX_SIZE,
    SECTION,
)
from firmware_runtime.recording.blackbox.ring_file import Header, header_in
from firmware_runtime.recording.blackbox.section import Kind, Section, decode
from firmware_runtime.statistics.number_formats import Dates

BEGINNINGS: Final = frozenset({Kind.BUILD, Kind.KEYFRAME})
"""Sections at which a replay can begin."""
_LOST: Final = Kind.LOST.value
_MOST_NAMED: Final = 3
_NO_HEADER: Final = (
    "damaged: no chunk of it begins with a whole header; expected a recording of a run "
    "(`recordings recover` saves what is whole)"
)
_EXPECTED: Final = f"expected {MAGIC!r} (`recordings recover` reads one whose beginning is lost)"


class Chunk(Struct, frozen=True):
    """One chunk, copied; `damage` says what is wrong at its end, None if nothing is."""

    number: int
    contents: list[bytes]
    damage: str | None
    lines: list[int] = []
    """The highest number of a line in each section; -1 for one without transfers."""


class Segment(Struct, frozen=True):
    """Sections in a row, as bytes, none missing."""

    contents: list[bytes]

    def from_beginning(self) -> "Segment | None":
        """From the first at which a replay can begin; None if there is none."""
        for place, content in enumerate(self.contents):
            if kind_of(content) in BEGINNINGS:
                return Segment(self.contents[place:])
        return None

    def from_instant(self, at: int) -> "Segment":
        """From the last at which a replay can begin that stands before that instant."""
        begin = 0
        for place, content in enumerate(self.contents):
            if kind_of(content) in BEGINNINGS:
                if decode(content).at >= at:
                    break
                begin = place
        return Segment(self.contents[begin:])

    @property
    def first_at(self) -> int:
        """The instant at which it begins, ns."""
        return decode(self.contents[0]).at

    @property
    def last_at(self) -> int:
        """The instant of the last step in it, ns."""
        steps = (each for each in reversed(self.contents) if kind_of(each) == Kind.STEP)
        return decode(last).at if (last := next(steps, None)) is not None else self.first_at

    def sections(self) -> Iterator[Section]:
        """All of them, headers left out."""
        for content in self.contents:
            if kind_of(content) != Kind.HEADER:
                yield decode(content)


def instants_in(contents: Iterable[bytes]) -> Iterator[int]:
    """Instants of the sections that have one of their own, ns."""
    return (section.at for section in map(decode, contents) if section.has_instant)


def kind_of(content: bytes) -> int:
    """The kind of a section, which is the first of its fields."""
    return content[1]


class Recording(Struct, frozen=True):
    """A recording that has at least a header."""

    path: Path
    header: Header
    chunks: list[Chunk]
    damages: list[str] = []
    """What is wrong with the file where no chunk can be read, one sentence each."""

    def contents(self) -> Iterator[bytes]:
        """All sections in order, also the header that begins each chunk."""
        return (content for chunk in self.chunks for content in chunk.contents)

    def faults(self) -> list[str]:
        """What is missing within it, one sentence each."""
        found = list(self.damages)
        found += [f"chunk {each.number}: {each.damage}" for each in self.chunks if each.damage]
        lost = [each for each in self.contents() if kind_of(each) == _LOST]
        found += [
            f"at {section.at / SECOND:g} s a section is missing: {section.extra}"
            for section in map(decode, lost[:_MOST_NAMED])
        ]
        if len(lost) > _MOST_NAMED:
            found.append(f"{len(lost) - _MOST_NAMED} more sections are missing")
        for before, after in zip(self.chunks, self.chunks[1:], strict=False):
            if after.number != before.number + 1:
                found.append(_missing(before.number + 1, after.number - 1))
        return found

    def no_keyframe(self) -> str | None:
        """Why the run had no keyframe at its end, as it says; None if it had, or does not say."""
        last = self.chunks[-1].contents[-1]
        extra = decode(last).extra if kind_of(last) == Kind.ENDED else None
        why = extra.get("no_keyframe") if isinstance(extra, dict) else None
        return why if isinstance(why, str) else None

    def segments(self) -> list["Segment"]:
        """What can be replayed: one segment, or several with something missing between them."""
        found: list[Segment] = []
        expected: int | None = None
        for chunk in self.chunks:
            if chunk.number != expected:
                found.append(Segment([]))
            for content in chunk.contents:
                if kind_of(content) == _LOST:
                    found.append(Segment([]))
                else:
                    found[-1].contents.append(content)
            expected = chunk.number + 1 if chunk.damage is None else None
        return [each for segment in found if (each := segment.from_beginning()) is not None]

    def dates(self) -> Dates:
        """When it was."""
        noted = [
            (section.at, section.extra[1])
            for content in self.contents()
            if kind_of(content) == Kind.DATE and _is_date((section := decode(content)).extra)
        ]
        began = self.header.began
        return Dates(None if began is None else began[1], noted, self.header.speed)

    @property
    def is_from_start(self) -> bool:
        """Whether it has the beginning of the run."""
        return self.chunks[0].number == 1


def _is_date(extra: Any) -> bool:  # noqa: ANN401 -- what is in a file
    is_pair = isinstance(extra, list) and len(extra) == 2
    return is_pair and all(type(each) is int for each in extra)


def _missing(first: int, last: int) -> str:
    return f"chunk {first} is missing" if first == last else f"chunks {first} to {last} are missing"


def read_recording(path: Path) -> Recording:
    """Read a file. Raises ConfigError, a sentence, for one of which nothing can be used."""
    with opened_content(path) as content:
        return _recording(content, path)


def recording_in(content: bytes, path: Path) -> Recording:
    """What the bytes of the file at `path` hold. Raises ConfigError as `read_recording`."""
    return _recording(content_of(content), path)


def another_format(path: Path, content: bytes) -> ConfigError:
    """That a file is a recording which this program does not read."""
    fault = f"a recording of another format, {content[: len(MAGIC)]!r}; expected {MAGIC!r}"
    return ConfigError.of_one(str(path), fault)


def _recording(content: Content, path: Path) -> Recording:
    begin = content.read(0, PREFIX_SIZE)
    if begin.startswith(MAGIC[:-1]) and not begin.startswith(MAGIC):
        raise another_format(path, begin)
    if len(begin) < PREFIX_SIZE or begin[: len(MAGIC)] != MAGIC:
        raise _foreign(path, f"it begins with {begin[:8]!r}")
    _, chunk_size, chunks = PREFIX.unpack_from(begin)
    if not (CHUNK.size < chunk_size <= LARGEST_CHUNK and 0 < chunks <= MOST_CHUNKS):
        raise _foreign(path, f"{chunks} chunks of {chunk_size} bytes")
    end = min(content.length, PREFIX_SIZE + chunks * chunk_size)
    begins = range(PREFIX_SIZE, end, chunk_size)
    read = {begin: _chunk(content.read(begin, chunk_size), chunk_size) for begin in begins}
    found = [each for each in read.values() if each is not None and len(each.contents) > 0]
    found.sort(key=lambda chunk: chunk.number)
    headers = (header_in(each.contents[0]) for each in found)
    header = next((each for each in headers if each is not None), None)
    if header is None:
        raise ConfigError.of_one(str(path), _NO_HEADER)
    found = [_with_lines(each, len(header.lines)) for each in found]
    lost = [
        begin
        for begin, each in read.items()
        if each is not None and each.damage and len(each.contents) == 0
    ]
    damages = [_unread(lost)] if lost else []
    if len(begins) < chunks:
        damages.append(
            f"the file ends after {content.length} bytes, {len(begins)} of {chunks} chunks"
        )
    return Recording(path, header, found, damages)


def _unread(begins: list[int]) -> str:
    """What is wrong with the chunks that begin there."""
    chunks = "a chunk" if len(begins) == 1 else f"{len(begins)} chunks, the first"
    return f"no section is whole of {chunks} at byte {begins[0]} of the file"


def _foreign(path: Path, why: str) -> ConfigError:
    return ConfigError.of_one(str(path), f"not a recording of a run: {why}; {_EXPECTED}")


def _chunk(content: bytes, size: int) -> Chunk | None:
    """A chunk as far as it is whole; None for one that was never written."""
    if len(content) < CHUNK.size:
        return None
    number, used = CHUNK.unpack_from(content)
    if number == 0:
        return None
    damage = None
    if used > size:
        used, damage = size, f"it says that {used} of {size} bytes are used"
    if used > len(content):
        used, damage = len(content), f"the file ends at {len(content)} of {used} bytes"
    contents: list[bytes] = []
    lines: list[int] = []
    place = CHUNK.size
    while place + SECTION.size <= used:
        length, checksum = SECTION.unpack_from(content, place)
        place += SECTION.size
        section = content[place : place + length]
        is_whole = place + length <= used and crc32(section) == checksum
        if not is_whole or (highest := _line_in(section)) is None:
            damage = damage or f"section {len(contents)} is damaged"
            break
        lines.append(highest)
        contents.append(section)
        place += length
    return Chunk(number, contents, damage, lines)


def _line_in(content: bytes) -> int | None:
    """The highest number of a line in a section, -1 without any; None for what is no section."""
    try:
        section = decode(content)
    except (msgspec.MsgspecError, RecursionError):
        return None
    is_in_time = 0 <= section.at <= NEVER
    if not is_in_time or not all(each.is_one for each in section.transfers):
        return None
    return max((each.line for each in section.transfers), default=-1)


def _with_lines(chunk: Chunk, count: int) -> Chunk:
    """The chunk up to the first section that has a transfer on a line that there is not."""
    for place, line in enumerate(chunk.lines):
        if line >= count:
            damage = f"section {place} has a transfer on line {line} of {count}"
            return Chunk(chunk.number, chunk.contents[:place], damage, chunk.lines[:place])
    return chunk
