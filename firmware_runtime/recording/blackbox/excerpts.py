"""What is kept of the recordings of a board's runs: pieces around what went wrong, and a copy.

In its folder, for the board's seventh run:

    tachobot-0007-crash-1.recording   all of the ring, of a run that failed or was killed
    tachobot-0007-late-2.recording    the minute before an activation that was late
    tachobot-0007-guard-3.recording   the minute before the guard took over
    tachobot-0007.recording           the ring's copy as it grew, if it is synced

All together take no more than the budget; the oldest make room for new ones.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.recording.blackbox.chunk_file import Numbered, file_of
from firmware_runtime.recording.blackbox.listing import state_at_end
from firmware_runtime.recording.blackbox.mirror import Mirror
from firmware_runtime.recording.blackbox.reader import instants_in
from firmware_runtime.recording.blackbox.ring_file import RingFile
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, replace_file

BEFORE: Final = 60 * SECOND
"""How much of the run before an incident is kept at least, where there is so much."""
CRASH: Final = "crash"
ENDED_WELL: Final = frozenset({"ended", "stopped"})


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
        if not chunks or state_at_end(chunks[-1][1]) in ENDED_WELL:
            return
        if not any(each.stem.startswith(f"{self._stem.name}-{CRASH}-") for each in self._of_run()):
            self._keep_piece(ring, CRASH, self._number + 1, None)

    def _keep_piece(self, ring: RingFile, why: str, number: int, span: int | None) -> None:
        """Keep so much of the ring, or all of it."""
        chunks = ring.chunks()
        if not chunks:
            return
        if span is not None:
            since = next(instants_in(reversed(chunks[-1][1])), 0) - span
            begins = [next(instants_in(contents), 0) for _, contents in chunks]
            before = [place for place, at in enumerate(begins) if at <= since]
            chunks = chunks[max(before, default=0) :]
        content = file_of([Numbered(*each) for each in chunks])
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
        own = None if self._mirror is None else self._mirror.path
        others = [
            each
            for each in self._stem.parent.glob(f"*{Companion.RECORDING}")
            if each not in {path, own}
        ]
        others.sort(key=lambda each: each.stat().st_mtime_ns)
        grown = self._ring.size if own is not None and self._ring is not None else 0
        taken = grown + sum(map(_taken, others))
        for each in others:
            if taken + size <= self._budget:
                break
            taken -= _taken(each)
            each.unlink()
            self._log(f"{each}: removed, to make room")
        return taken + size <= self._budget

    def _named(self, ending: str) -> Path:
        return self._stem.with_name(f"{self._stem.name}{ending}{Companion.RECORDING}")

    def _of_run(self) -> list[Path]:
        return list(self._stem.parent.glob(f"{self._stem.name}-*{Companion.RECORDING}"))


def _number(path: Path) -> int:
    said = path.stem.rpartition("-")[2]
    return int(said) if said.isdigit() else 0


def _taken(path: Path) -> int:
    """Bytes of the disk that a file takes."""
    return path.stat().st_blocks * 512


def _mebibytes(size: int) -> str:
    return f"{size / (1 << 20):.0f} MiB"
