"""Reading a recording: its header, its sections in order, and what is wrong with the file.

A file is taken for what is whole in it. A section whose CRC-32 is wrong ends its chunk, a chunk
that is missing between two leaves a gap; both are said, and what follows begins at a keyframe.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from zlib import crc32

import msgspec
from msgspec import Struct

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    MAGIC,
    PREFIX_SIZE,
    Chunk,
    sections_in,
)
from firmware_runtime.recording.blackbox.ring_file import Header, RingFile, header_in, opened
from firmware_runtime.recording.blackbox.section import Kind, Section, decode
from firmware_runtime.statistics.number_formats import Dates

BEGINNINGS: Final = frozenset({Kind.BUILD, Kind.KEYFRAME})
"""Sections at which a replay can begin."""
_LOST: Final = Kind.LOST.value
_MOST_NAMED: Final = 3
NO_HEADER: Final = (
    "damaged: no chunk of it begins with a whole header; expected a recording of a run "
    "(`recordings recover` saves what is whole)"
)
_EXPECTED: Final = f"expected {MAGIC!r} (`recordings recover` reads one whose beginning is lost)"


class Segment(Struct, frozen=True):
    """Sections in a row, as bytes, none missing; headers are left out."""

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
        """All of them."""
        return map(decode, self.contents)


def instants_in(contents: Iterable[bytes]) -> Iterator[int]:
    """Instants of the sections that have one of their own, ns."""
    return (section.at for section in map(decode, contents) if section.has_instant)


def end_in(contents: Sequence[bytes]) -> Mapping[str, Any]:
    """What the last sections of a run say of its end; empty where they say nothing."""
    last = next((each for each in reversed(contents) if kind_of(each) == Kind.ENDED), None)
    extra = None if last is None else decode(last).extra
    return extra if isinstance(extra, dict) else {}


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
        why = end_in(self.chunks[-1].contents).get("no_keyframe")
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
                elif kind_of(content) != Kind.HEADER:
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


def no_instant(recording: Recording, at: int) -> ConfigError:
    """Return the error of a recording that cannot be run again from an instant, ns."""
    segments = recording.segments()
    if not segments:
        why = recording.no_keyframe()
        said = f"no section of it can be a beginning{'' if why is None else f' ({why})'}"
        expected = "expected a keyframe, or the start of the run"
    else:
        spans = [(each.first_at / SECOND, each.last_at / SECOND) for each in segments]
        ends = spans[-1][1]
        said = f"it ends at {ends:g} s" if at / SECOND > ends else f"it has no {at / SECOND:g} s"
        whole = " or ".join(f"from {begin:g} to {end:g} s" for begin, end in spans)
        expected = f"expected an instant {whole}"
    return ConfigError.of_one(str(recording.path), f"{said}{damage(recording)}; {expected}")


def damage(recording: Recording) -> str:
    """A clause that names what is damaged and what can be done; empty for a whole recording."""
    faults = recording.faults()
    if not faults:
        return ""
    more = f"; {len(faults) - _MOST_NAMED} more" if len(faults) > _MOST_NAMED else ""
    named = "; ".join(faults[:_MOST_NAMED])
    return f", and it is damaged ({named}{more}: `recordings recover` saves what is whole)"


def _is_date(extra: Any) -> bool:  # noqa: ANN401 -- what is in a file
    is_pair = isinstance(extra, list) and len(extra) == 2
    return is_pair and all(type(each) is int for each in extra)


def _missing(first: int, last: int) -> str:
    return f"chunk {first} is missing" if first == last else f"chunks {first} to {last} are missing"


def another_format(path: Path, content: bytes) -> ConfigError:
    """That a file is a recording which this program does not read."""
    fault = f"a recording of another format, {content[: len(MAGIC)]!r}; expected {MAGIC!r}"
    return ConfigError.of_one(str(path), fault)


def check_prefix(file: RingFile, path: Path) -> None:
    """Raise ConfigError for a file that does not begin as a recording of this format does."""
    said = file.prefix
    if said.startswith(MAGIC[:-1]) and not said.startswith(MAGIC):
        raise another_format(path, said)
    if file.count == 0:
        fault = f"not a recording of a run: it begins with {said[: len(MAGIC)]!r}; {_EXPECTED}"
        raise ConfigError.of_one(str(path), fault)


def read_recording(path: Path) -> Recording:
    """Read a file. Raises ConfigError, a sentence, for one of which nothing can be used."""
    with opened(path) as file:
        return _recording(file, path)


def _recording(file: RingFile, path: Path) -> Recording:
    check_prefix(file, path)
    length = file.status.st_size
    with_a_head = length - PREFIX_SIZE - (CHUNK.size - 1)
    present = min(file.count, -(-with_a_head // file.chunk_size))
    read = {place: _chunk(file.chunk(place), file.chunk_size) for place in range(present)}
    found = [each for each in read.values() if each is not None and len(each.contents) > 0]
    found.sort(key=lambda chunk: chunk.number)
    header = header_in(found[0].contents[0]) if found else None
    if header is None:
        raise ConfigError.of_one(str(path), NO_HEADER)
    lost = [
        file.begin(place)
        for place, each in read.items()
        if each is not None and each.damage and not each.contents
    ]
    damages = [_unread(lost)] if lost else []
    if present < file.count:
        damages.append(f"the file ends after {length} bytes, {present} of {file.count} chunks")
    return Recording(path, header, found, damages)


def _unread(begins: list[int]) -> str:
    """What is wrong with the chunks that begin there."""
    chunks = "a chunk" if len(begins) == 1 else f"{len(begins)} chunks, the first"
    return f"no section is whole of {chunks} at byte {begins[0]} of the file"


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
    lines = 0
    for section, checksum in sections_in(content, used):
        header = None if contents else header_in(section)
        lines = lines if header is None else len(header.lines)
        is_whole = crc32(section) == checksum and (contents or header is not None)
        if why := _why_damaged(section, lines) if is_whole else "is damaged":
            damage = damage or f"section {len(contents)} {why}"
            break
        contents.append(section)
    return Chunk(number, contents, damage)


def _why_damaged(content: bytes, lines: int) -> str | None:
    """Return what is wrong with a section of a run that had so many lines; None if it is one."""
    try:
        section = decode(content)
    except msgspec.MsgspecError:
        return "is damaged"
    is_in_time = 0 <= section.at <= NEVER
    if not is_in_time or not all(each.is_one for each in section.transfers):
        return "is damaged"
    highest = max((each.line for each in section.transfers), default=-1)
    return f"has a transfer on line {highest} of {lines}" if highest >= lines else None
