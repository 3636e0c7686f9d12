"""The flight recorder: what ran when, the latest of it, in a ring that any process may read.

The file stands beside the statistics (`BOARD.spans`) and is mapped like them: rows of four cells,

    sequence and track | begin, ns | end, ns | sequence

The writer numbers its rows from 1 on, writes each from left to right and overwrites the oldest; it
knows of no reader. A reader copies the ring twice. A row whose two sequences agree was not half
written when it was copied, and if its first one is the same in the second copy, it was not being
overwritten meanwhile. Between the copies the reader waits, for processors that reorder stores.
"""

from collections.abc import Sequence
from pathlib import Path
from struct import Struct

import msgspec

from firmware_runtime.statistics.mapped_file import Kind
from firmware_runtime.statistics.reader import settle
from firmware_runtime.system.process_identity import this_process

TRACKS = ("waking", "step", "garbage")
"""The first tracks of every file; those of the models follow."""
WAKING, STEP, GARBAGE, MODELS = range(4)
_SPANS = Kind("flight recorder's file", b"FWRTSPAN", 1)
_ROW = Struct("4q")
_TRACK_BITS = 16


class Recorded(msgspec.Struct, frozen=True):
    """One entry: `track` was busy from `begin_ns` to `end_ns`, in ns since the start of the run.

    Tracks: `waking` (from a step's deadline to its start), `step`, `garbage`, and for each model
    its path: one entry for each of its functions that ran.
    """

    track: str
    begin_ns: int
    end_ns: int


class SpanRing:
    """The writing end: the last `rows` entries of `TRACKS` and the models' tracks."""

    def __init__(self, models: Sequence[str], rows: int, path: Path | None = None) -> None:
        header = {"tracks": [*TRACKS, *models], "writer": msgspec.to_builtins(this_process())}
        cells = _SPANS.create(path, header, 4 * rows)
        self._bytes = cells.cast("B")
        self._size = len(self._bytes)
        self._sequence = 0

    def record(self, track: int, begin: int, end: int) -> None:
        """Write one entry; `track` by its number in the order of names."""
        self._sequence = sequence = self._sequence + 1
        place = sequence * _ROW.size % self._size
        _ROW.pack_into(self._bytes, place, sequence << _TRACK_BITS | track, begin, end, sequence)


def read_spans(path: Path) -> list[Recorded]:
    """Copy what a run has recorded, the oldest first.

    Raises StatisticsFileError when there is no such file, or it is not whole.
    """
    with _SPANS.opened(path) as file:
        tracks, size = file.header.get("tracks"), file.cell_bytes
        if not isinstance(tracks, list) or size % _ROW.size != 0:
            raise file.damaged(f"{size} bytes of cells and tracks {tracks!r}")
        copy = file.read()
        settle()
        later = file.read()
    rows = sorted(
        row
        for row, again in zip(_ROW.iter_unpack(copy), _ROW.iter_unpack(later), strict=True)
        if row[0] == again[0] and row[0] >> _TRACK_BITS == row[3] > 0
    )
    numbers = [first & (1 << _TRACK_BITS) - 1 for first, *_ in rows]
    if max(numbers, default=0) >= len(tracks):
        raise file.damaged(f"an entry of track {max(numbers)} of {len(tracks)}")
    return [
        Recorded(tracks[number], begin, end)
        for number, (_, begin, end, _) in zip(numbers, rows, strict=True)
    ]
