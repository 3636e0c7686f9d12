"""Recordings of runs off the robot, kept on the disk.

A run writes into memory, so that no disk holds it up. On a robot that is the service's, and
`record` brings it to the disk. Elsewhere it is that of a login session or among temporary files,
which go when the user does: so what was recorded is copied to where programs keep their state when
the run is over, or, of one that was killed, when the board's next run begins.
"""

import errno
import os
from collections.abc import Iterator
from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.chunk_file import used_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.ring_file import RingFile
from firmware_runtime.statistics.paths import Companion, is_of_session
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, replace_file


def state_folder() -> Path:
    """Where recordings are kept for good, in a folder for each board."""
    stated = os.environ.get("XDG_STATE_HOME", "")
    home = Path(stated) if os.path.isabs(stated) else Path.home() / ".local/state"  # noqa: PTH117
    return home / "firmware-runtime"


def place_for(recording: Path, board: str) -> Path | None:
    """The folder for what a run writes there; None where it stays where it is."""
    return state_folder() / board if is_of_session(recording.parent) else None


def persist(recording: Path, folder: Path, budget: int) -> Path | None:
    """Copy what was recorded into a folder, and remove the oldest there beyond a budget of bytes.

    Return the copy; None where there is nothing to copy, or it has been copied before. Raises
    OSError, and ConfigError for what is no recording.
    """
    if not recording.is_file():
        return None
    try:
        with RingFile(recording) as ring:
            header = ring.header()
    except OSError as error:
        if error.errno == errno.EINVAL:  # no recording, or an older program's
            return None
        raise
    if header is None or Path(header.run).name != header.run:
        return None
    copy = folder / f"{header.run}{Companion.RECORDING}"
    if copy.exists():
        return None
    content = used_of(read_recording(recording))
    folder.mkdir(parents=True, exist_ok=True)
    if len(content) > budget:
        fault = f"{len(content) >> 20} MiB are more than recording.keep_mib"
        raise ConfigError.of_one(str(recording), fault)
    _make_room(folder, budget - len(content))
    replace_file(copy, content, OWN_AND_GROUP)
    return copy


def _make_room(folder: Path, left: int) -> None:
    """Remove the oldest recordings until the others take no more than is left."""
    for path, size in _newest_first(folder):
        left -= size
        if left < 0:
            path.unlink(missing_ok=True)


def _newest_first(folder: Path) -> Iterator[tuple[Path, int]]:
    found = [(path, path.stat()) for path in folder.glob(f"*{Companion.RECORDING}")]
    for path, status in sorted(found, key=lambda each: -each[1].st_mtime_ns):
        yield path, status.st_size
