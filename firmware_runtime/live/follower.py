"""Follows a recording while a run writes it: what is new since the last look, section by section.

The run has no part in it: its ring is a file in memory that is read. A reader that is too slow
finds its chunk written over; then it says so, and goes on with what is there.
"""

from pathlib import Path
from typing import Final
from zlib import crc32

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import CHUNK, sections_in
from firmware_runtime.recording.blackbox.reader import NO_HEADER, check_prefix, kind_of
from firmware_runtime.recording.blackbox.ring_file import RingFile, Slot, opened
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.system.resources import Closing

_BEGIN: Final = CHUNK.size


class Follower(Closing):
    """Sections of the ring at `path`, in order. Raises ConfigError for what is no recording.

    `has_gap` is True once something between two sections was missed, until `poll` is called again.
    """

    def __init__(self, path: Path) -> None:
        with opened(path) as file:
            check_prefix(file, path)
            header = file.header()
            self.inode = file.status.st_ino
        if header is None:
            raise ConfigError.of_one(str(path), NO_HEADER)
        self.path, self.header = path, header
        self.has_gap = False
        self._ring = RingFile(path)
        self._number = 0
        self._used = _BEGIN

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

    def poll(self) -> list[bytes]:
        """Read what is new, without headers."""
        self.has_gap = False
        found: list[bytes] = []
        slots = {
            slot.number: place
            for place in range(self._ring.count)
            if (slot := self._ring.slot(place)).number
        }
        if not slots:
            return found
        for number in range(self._first(slots), max(slots) + 1):
            if number not in slots or not self._read(number, slots[number], found):
                self.has_gap = True
                found.clear()
                self._go_to(number + 1)
        return found

    def _first(self, slots: dict[int, int]) -> int:
        """The chunk to go on with."""
        if self._number < min(slots):
            self.has_gap = self._number > 0
            self._go_to(min(slots))
        return self._number

    def _go_to(self, number: int) -> None:
        self._number, self._used = number, _BEGIN

    def _read(self, number: int, place: int, found: list[bytes]) -> bool:
        """Take what is new in a chunk; return whether it is whole and follows what was before."""
        if number != self._number:
            self._go_to(number)
        slot: Slot = self._ring.slot(place)
        if slot.number != number:
            return False
        content = self._ring.content(place, self._used, slot)
        if content is None:
            return False
        for section, checksum in sections_in(bytes(_BEGIN) + content, _BEGIN + len(content)):
            if crc32(section) != checksum:
                return False
            if kind_of(section) != Kind.HEADER:
                found.append(section)
        self._used = slot.used
        return True
