"""Follows a recording while a run writes it: what is new, section by section.

The run has no part in it: its ring is a file in memory that is read, a chunk at a time, so the
memory that takes is that of a chunk, however much there is to read. A reader that is too slow finds
its chunk written over; then it says so, and goes on with what is there.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Final
from zlib import crc32

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import CHUNK, SECTION, sections_in
from firmware_runtime.recording.blackbox.reader import (
    BEGINNINGS,
    NO_HEADER,
    check_prefix,
    kind_of,
)
from firmware_runtime.recording.blackbox.ring_file import RingFile, Slot, opened
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.system.resources import Closing

_BEGIN: Final = CHUNK.size


class Follower(Closing):
    """Sections of the ring at `path`, in order. Raises ConfigError for what is no recording."""

    def __init__(self, path: Path) -> None:
        with opened(path) as file:
            check_prefix(file, path)
            header = file.header()
            self.inode = file.status.st_ino
        if header is None:
            raise ConfigError.of_one(str(path), NO_HEADER)
        self.path, self.header = path, header
        self._ring = RingFile(path)
        self._number = 0
        """Of the chunk that is read; 0 before the first."""
        self._used = _BEGIN
        """Bytes of it that have been read."""

    def close(self) -> None:
        """Close the file."""
        self._ring.close()

    @property
    def is_replaced(self) -> bool:
        """Whether another run has put its own recording in the place of this one."""
        try:
            return self.path.stat().st_ino != self.inode
        except OSError:
            return True

    @property
    def chunks_behind(self) -> int:
        """Chunks that the run has begun since the one that is read."""
        return max(self._places(), default=0) - self._number

    def skip_to_beginning(self, steps: int) -> None:
        """Skip to the last section that has so many steps behind it and can begin a replay.

        To the first such section where there are fewer, to the newest chunk where there is none.
        """
        here, there = (self._number, self._used), None
        for place, behind in self._beginnings():
            if place < here:
                break
            there = place
            if behind >= steps:
                break
        self._number, self._used = there or (max(self._places(), default=0), _BEGIN)

    def sections(self) -> Iterator[bytes | None]:
        """Yield what is new, without headers; None where something is missing.

        One that is left goes on there next time.
        """
        places = self._places()
        newest = max(places, default=0)
        if self._number < min(places, default=0):
            if self._number > 0:
                yield None
            self._go_to(min(places))
        for number in range(self._number, newest + 1):
            if number > self._number:
                self._go_to(number)
            if number in places:
                for section, end in self._sections_in(number, places[number], self._used):
                    self._used = end
                    if kind_of(section) != Kind.HEADER:
                        yield section
            if number < newest and not self._has_all_of(number, places):
                yield None

    def _go_to(self, number: int) -> None:
        self._number, self._used = number, _BEGIN

    def _has_all_of(self, number: int, places: dict[int, int]) -> bool:
        """Return whether a chunk that is finished has been read to its end."""
        return number in places and self._ring.slot(places[number]) == Slot(number, self._used)

    def _places(self) -> dict[int, int]:
        """Where each chunk is, by its number."""
        numbers = ((self._ring.slot(place).number, place) for place in range(self._ring.count))
        return {number: place for number, place in numbers if number}

    def _beginnings(self) -> Iterator[tuple[tuple[int, int], int]]:
        """Yield where a replay can begin, the last first, and how many steps are behind it."""
        behind = 0
        places = self._places()
        for number in sorted(places, reverse=True):
            sections = [
                (kind_of(section), end - len(section) - SECTION.size)
                for section, end in self._sections_in(number, places[number], _BEGIN)
            ]
            for kind, begin in reversed(sections):
                behind += kind == Kind.STEP
                if kind in BEGINNINGS:
                    yield (number, begin), behind

    def _sections_in(self, number: int, place: int, begin: int) -> Iterator[tuple[bytes, int]]:
        """Yield what is whole of a chunk from a byte on, and where each section ends."""
        slot = self._ring.slot(place)
        if slot.number != number:
            return
        content = self._ring.content(place, begin - CHUNK.size, slot)
        if content is None:
            return
        end = begin
        for section, checksum in sections_in(content, len(content)):
            if crc32(section) != checksum:
                return
            end += SECTION.size + len(section)
            yield section, end
