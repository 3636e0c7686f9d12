"""Paths of recordings: where they are, which one a name means, and what is kept on the disk.

The last run's is beside its statistics, one for real and one for virtual time, and one
of the last start that failed. What `record` has
kept of a board's runs is in a folder of the board's own below `/var/lib/firmware-runtime`, or below
`$FIRMWARE_RUNTIME_KEPT_DIRECTORY`.

A run writes into memory, so that no disk holds it up. On a robot that is the service's, and the
recorder brings it to the disk. Elsewhere it is that of a login session or among temporary files,
which go when the user does: so what was recorded is copied to where programs keep their state when
the run is over, or, of one that was killed, when the board's next run begins.
"""

import os
from collections.abc import Collection
from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import MAGIC, file_of
from firmware_runtime.recording.blackbox.ring_file import RingFile, check_file
from firmware_runtime.statistics.paths import (
    Companion,
    default_path,
    directories,
    is_of_session,
    looks_in_one_only,
    not_looked_in,
    places,
)
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, owner_of_folder, replace_file

KEPT = Path("/var/lib/firmware-runtime")
VIRTUAL = f".virtual{Companion.RECORDING}"
FAILED_START = f".start{Companion.RECORDING}"
_ENDING = Companion.RECORDING.value
_OF_LAST_RUN = (Companion.RECORDING, VIRTUAL, FAILED_START)


def recording_beside(statistics: Path) -> Path:
    """Where a run with these statistics keeps its recording."""
    return Companion.RECORDING.beside(statistics)


def recording_of_virtual_run(board: str) -> Path:
    """Where a run in virtual time, which has no statistics that others see, keeps its recording."""
    return default_path(board).with_suffix(VIRTUAL)


def virtual_recordings(board: str) -> list[Path]:
    """The recordings there are of a board's last run in virtual time: one a directory."""
    return [path for each in places(board) if (path := each.with_suffix(VIRTUAL)).is_file()]


def failed_start_beside(recording: Path) -> Path:
    """Where a start that failed is kept, given where its run would have had its recording."""
    name = recording.name.removesuffix(VIRTUAL).removesuffix(Companion.RECORDING)
    return recording.with_name(f"{name}{FAILED_START}")


def find_recording(run: str) -> Path:
    """The recording that is meant: a file, the last run of a board, or one that was kept.

    A board whose last run has left none, as after a loss of power, means the newest that was kept
    of it.

    Raises ConfigError, a sentence, if there is none.
    """
    if os.sep in run or os.path.isfile(run):  # noqa: PTH113 -- raises for no name
        check_file(Path(run))
        return Path(run)
    beside = [
        path
        for statistics in places(run)
        for path in map(statistics.with_suffix, _OF_LAST_RUN)
        if path.is_file()
    ]
    found = beside or [each for each in kept_recordings() if each.name == f"{run}{_ENDING}"]
    found = found or kept_recordings(run)
    if not found:
        looked_in = dict.fromkeys(str(each.parent) for each in places(run))
        where = ", ".join((*looked_in, *map(str, kept_directories())))
        fault = f"no file, and no run of a board of this name has left a recording in {where}"
        expected = "expected a recording's file, a board, or a name that `recordings list` shows"
        raise ConfigError.of_one(run, f"{fault}{not_looked_in()}; {expected}")
    return max(found, key=lambda path: path.stat().st_mtime_ns)


def recording_beside_statistics(kept: Path) -> Path:
    """The recording of the run with its statistics there. Raises ConfigError if it left none."""
    path = recording_beside(kept)
    if not path.is_file():
        fault = f"no recording of the run beside {kept}"
        expected = "expected one with recording.minutes over 0 in its board.toml"
        raise ConfigError.of_one(str(path), f"{fault}; {expected}")
    return path


def kept_directory() -> Path:
    """The folder in which each board has one for what was kept of its runs."""
    return Path(os.environ.get("FIRMWARE_RUNTIME_KEPT_DIRECTORY", KEPT))


def kept_directories() -> list[Path]:
    """That folder, and the one for runs off the robot."""
    return [kept_directory()] if looks_in_one_only() else [kept_directory(), state_folder()]


def kept_recordings(board: str | None = None) -> list[Path]:
    """The recordings that were kept, of one board or of all, in order of their names."""
    if board in {"", ".", ".."}:  # no board's name, but a folder's
        return []
    pattern = f"{'*' if board is None else _escaped(board)}/*{Companion.RECORDING}"
    folders = [each for each in kept_directories() if owner_of_folder(each) is None]
    return [each for folder in folders for each in sorted(folder.glob(pattern)) if each.is_file()]


def last_recordings(board: str | None = None) -> list[Path]:
    """The recordings of last runs, beside their statistics, of one board or of all."""
    endings = _OF_LAST_RUN if board else (Companion.RECORDING,)
    names = [f"{_escaped(board) if board else '*'}{each}" for each in endings]
    found = (path for folder in directories() for name in names for path in folder.glob(name))
    return sorted(dict.fromkeys(each for each in found if each.is_file()))


def _escaped(name: str) -> str:
    from glob import escape  # noqa: PLC0415 -- to look for one; a run knows its own

    return escape(name)


def is_black_box(path: Path) -> bool:
    """Whether it is a regular file that begins as a recording does; False if it cannot be read."""
    try:
        if not path.is_file():  # a device is not even opened, a pipe not waited for
            return False
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except (OSError, ValueError):
        return False


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
    with RingFile(recording) as ring:
        header = ring.header()
    if header is None or Path(header.run).name != header.run:  # an older program's, or none
        return None
    copy = folder / f"{header.run}{Companion.RECORDING}"
    if copy.exists():
        return None
    # the start of a run, which looks for what is to be copied, mostly finds nothing
    from firmware_runtime.recording.blackbox.reader import read_recording  # noqa: PLC0415

    content = file_of(read_recording(recording).chunks)
    folder.mkdir(parents=True, exist_ok=True)
    if len(content) > budget:
        fault = f"{len(content) >> 20} MiB are more than recording.keep_mib"
        raise ConfigError.of_one(str(recording), fault)
    make_room(folder, budget - len(content))
    replace_file(copy, content, OWN_AND_GROUP)
    return copy


def make_room(folder: Path, left: int, kept: Collection[Path] = ()) -> list[Path]:
    """Remove the oldest recordings until the others take no more of the disk than is left.

    Return what was removed, the oldest first; those that are `kept` do not count.
    """
    found = [each for each in folder.glob(f"*{_ENDING}") if each not in kept]
    statuses = {path: path.stat() for path in found}
    left -= sum(each.st_blocks * 512 for each in statuses.values())
    removed = []
    for path, status in sorted(statuses.items(), key=lambda each: each[1].st_mtime_ns):
        if left >= 0:
            break
        left += status.st_blocks * 512
        path.unlink(missing_ok=True)
        removed.append(path)
    return removed
