"""What is kept of the recordings of a board's runs: pieces around what went wrong, and a copy.

In its folder, for the board's seventh run:

    tachobot-0007-crash-1.recording   all of the ring, of a run that failed or was killed
    tachobot-0007-late-2.recording    the minute before an activation that was late
    tachobot-0007-guard-3.recording   the minute before the guard took over
    tachobot-0007.recording           the ring's copy as it grew, if it is synced

All together take no more than the budget; the oldest make room for new ones.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.recording.blackbox.layout import CHUNK, file_of
from firmware_runtime.recording.blackbox.locations import make_room
from firmware_runtime.recording.blackbox.reader import end_in, instants_in
from firmware_runtime.recording.blackbox.ring_file import RingFile, Slot
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, replace_file, sync_folder
from firmware_runtime.system.resources import Closing
from firmware_runtime.system.this_system import sync_content

BEFORE: Final = 60 * SECOND
"""How much of the run before an incident is kept at least, where there is so much."""
CRASH: Final = "crash"
ENDED_WELL: Final = frozenset({"ended", "stopped"})


_MODE: Final = 0o640


class Mirror(Closing):
    """A ring's copy on a disk at `path`, which grows with the run: what power loss leaves of it.

    It has the ring's layout. At each sync what is new is written and waited for, and only then each
    chunk says how much of it is used: the disk never holds a chunk that says more than it has.
    Raises OSError.
    """

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
        sync_content(self._descriptor)
        for place, slot in new.items():
            begin = CHUNK.pack(slot.number, slot.used)
            os.pwrite(self._descriptor, begin, self._ring.begin(place))
            self._written[place] = slot
        sync_content(self._descriptor)

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


class Pieces:
    """Keeps recordings of the runs whose statistics are at `kept`, of one run at a time.

    `budget` is in bytes; a sync comes every `sync` ns, 0: none. `log` gets a line for every file.
    Its functions raise StatisticsFileError if the folder cannot be written.
    """

    def __init__(self, kept: Path, budget: int, sync: int, log: Callable[[str], None]) -> None:
        self._path = Companion.RECORDING.beside(kept)
        self._budget = budget
        self._sync = sync
        self._log = log
        self._stem = kept
        self._pid = 0
        self._ring: RingFile | None = None
        self._mirror: Mirror | None = None
        self._sync_at = 0
        self._is_synced = False
        self._number = 0

    def begin(self, stem: Path, pid: int) -> None:
        """A run has begun, of this process; names of what is kept of it begin with `stem`."""
        self.close()
        self._stem, self._pid = stem, pid
        self._sync_at = 0
        self._is_synced = self._sync > 0
        self._number = max((_number(each) for each in self._of_run()), default=0)
        self._find()

    def poll(self, now: int) -> None:
        """Sync if it is time to."""
        if self._ring is None:
            self._find()
        elif now >= self._sync_at:
            self._sync_at = now + self._sync
            self.sync()

    def sync(self) -> None:
        """Bring what is new to the disk, if it is synced at all."""
        if self._ring is not None and self._is_synced:
            self._write(self._ring, self._synced)

    def keep(self, why: str, number: int) -> None:
        """Keep the minute before this moment, as the how manieth incident of the run."""
        self._number = max(self._number, number)
        if self._ring is not None:
            self._write(self._ring, lambda ring: self._keep_piece(ring, why, number, BEFORE))

    def over(self) -> None:
        """The run is over: keep all of it unless it ended well."""
        self._find()
        ring = self._ring
        if ring is not None:
            if self._is_synced:
                self._write(ring, self._synced)
            self._write(ring, self._keep_crash)
        self.close()

    def close(self) -> None:
        """Let go of the run."""
        if self._mirror is not None:
            self._mirror.close()
        if self._ring is not None:
            self._ring.close()
        self._ring = self._mirror = None

    # ----------------------------------------------------------------------------------------------

    def _find(self) -> None:
        """Open the ring of the run, if it is there; what is left of another run is none of it."""
        if self._ring is not None or self._pid == 0:
            return
        try:
            ring = RingFile(self._path)
        except OSError:
            return
        header = ring.header()
        if header is not None and header.run.endswith(f"-{self._pid}"):
            self._ring = ring
        else:
            ring.close()

    def _write(self, ring: RingFile, write: Callable[[RingFile], None]) -> None:
        try:
            write(ring)
        except OSError as error:
            raise StatisticsFileError(
                f"the recording cannot be kept there ({error.strerror})",
                where=self._stem.parent,
                expected="a folder that this user may write, with room in it",
            ) from error

    def _synced(self, ring: RingFile) -> None:
        path = self._named("")
        if self._mirror is None:
            if not self._make_room(ring.size, path):
                self._is_synced = False
                return
            self._mirror = Mirror(ring, path)
        self._mirror.sync()

    def _keep_crash(self, ring: RingFile) -> None:
        chunks = ring.chunks()
        if not chunks or str(end_in(chunks[-1].contents).get("state")) in ENDED_WELL:
            return
        if not any(each.stem.startswith(f"{self._stem.name}-{CRASH}-") for each in self._of_run()):
            self._keep_piece(ring, CRASH, self._number + 1, None)

    def _keep_piece(self, ring: RingFile, why: str, number: int, span: int | None) -> None:
        """Keep so much of the ring, or all of it."""
        chunks = ring.chunks()
        if not chunks:
            return
        if span is not None:
            since = next(instants_in(reversed(chunks[-1].contents)), 0) - span
            begins = [next(instants_in(each.contents), 0) for each in chunks]
            before = [place for place, at in enumerate(begins) if at <= since]
            chunks = chunks[max(before, default=0) :]
        content = file_of(chunks)
        path = self._named(f"-{why}-{number}")
        if self._make_room(len(content), path):
            replace_file(path, content, OWN_AND_GROUP, synced=True)
            self._log(f"{path}: the recording of the run")

    def _make_room(self, size: int, path: Path) -> bool:
        """Remove the oldest until so many bytes fit in; whether they can."""
        if size > self._budget:
            fault = f"its {_mebibytes(size)} are more than the budget of {_mebibytes(self._budget)}"
            self._log(f"{path}: not kept; {fault}")
            return False
        own = set() if self._mirror is None else {self._mirror.path}
        grown = self._ring.size if own and self._ring is not None else 0
        if grown + size > self._budget:
            beside = f"its {_mebibytes(size)} do not fit beside {_mebibytes(grown)} of the run"
            self._log(f"{path}: not kept; {beside}; the budget is {_mebibytes(self._budget)}")
            return False
        left = self._budget - size - grown
        for each in make_room(self._stem.parent, left, {path, *own}):
            self._log(f"{each}: removed, to make room")
        return True

    def _named(self, ending: str) -> Path:
        return self._stem.with_name(f"{self._stem.name}{ending}{Companion.RECORDING}")

    def _of_run(self) -> list[Path]:
        return list(self._stem.parent.glob(f"{self._stem.name}-*{Companion.RECORDING}"))


def _number(path: Path) -> int:
    said = path.stem.rpartition("-")[2]
    return int(said) if said.isdecimal() else 0


def _mebibytes(size: int) -> str:
    return f"{size / (1 << 20):.0f} MiB"
