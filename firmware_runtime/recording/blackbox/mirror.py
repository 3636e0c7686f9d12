"""A ring's copy on a disk, which grows with the run: what power loss leaves of it.

It has the ring's layout. At each sync what is new is written and waited for, and only then each
chunk says how much of it is used: the disk never holds a chunk that says more than it has.
"""

import os
from pathlib import Path

from firmware_runtime.recording.blackbox.layout import CHUNK
from firmware_runtime.recording.blackbox.ring_file import RingFile, Slot
from firmware_runtime.system.atomic_file import sync_folder
from firmware_runtime.system.resources import Closing

_MODE = 0o640


class Mirror(Closing):
    """The copy of `ring` at `path`. Raises OSError."""

    def __init__(self, ring: RingFile, path: Path) -> None:
        self.path = path
        self._ring = ring
        self._written = [Slot(0, 0)] * ring.count
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        self._descriptor = os.open(path, flags, _MODE)
        os.pwrite(self._descriptor, ring.prefix, 0)
        os.pwrite(self._descriptor, ring.spare, ring.size)
        sync_folder(path.parent)

    def sync(self) -> None:
        """Copy what is new, and return when the disk has it. Raises OSError."""
        new = {place: slot for place in range(self._ring.count) if (slot := self._copy(place))}
        if not new:
            return
        os.fdatasync(self._descriptor)
        for place, slot in new.items():
            begin = CHUNK.pack(slot.number, slot.used)
            os.pwrite(self._descriptor, begin, self._ring.begin(place))
            self._written[place] = slot
        os.fdatasync(self._descriptor)

    def close(self) -> None:
        """Let it go; the file stays. Again does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _copy(self, place: int) -> Slot | None:
        """Copy what is new in a chunk, and return how much of it there is now; None: nothing."""
        slot, before = self._ring.slot(place), self._written[place]
        if slot.number == 0 or slot == before:
            return None
        is_longer = slot.number == before.number
        begin = before.used if is_longer else CHUNK.size
        content = self._ring.content(place, begin, slot)
        if content is None:
            return None
        if not is_longer:  # what it said of the chunk before is true no more
            os.pwrite(self._descriptor, bytes(CHUNK.size), self._ring.begin(place))
        os.pwrite(self._descriptor, content, self._ring.begin(place) + begin)
        return slot
