"""Paths of a run's files: one a board, in the first directory of these that there is.

1. `$FIRMWARE_RUNTIME_STATE_DIRECTORY`; if it is set, no other is looked at
2. `$RUNTIME_DIRECTORY`, which systemd sets for a unit with `RuntimeDirectory=`
3. `/run/firmware-runtime`; to write, this user must be allowed to
4. `firmware-runtime` in `$XDG_RUNTIME_DIR`
5. `firmware-runtime-<user id>` in the directory for temporary files, closed to other users
"""

import os
import stat
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.system.atomic_file import owner_of_folder, refused

SYSTEM = Path("/run/firmware-runtime")
SUFFIX = ".stats"
_ALONE = "FIRMWARE_RUNTIME_STATE_DIRECTORY"


def default_path(board: str) -> Path:
    """Return where a run of this board writes its statistics.

    Raises StatisticsFileError when only the directory for temporary files is left and another user
    has taken our place in it.
    """
    if (alone := os.environ.get(_ALONE)) and (owner := owner_of_folder(Path(alone))) is not None:
        raise StatisticsFileError(refused(Path(alone), owner))
    usable = (each for each in _looked_in() if each != SYSTEM or os.access(each, os.W_OK))
    directory = next(usable, None) or _claimed(_temporary())
    return directory / f"{board}{SUFFIX}"


def find_statistics(board: str | None = None) -> Path:
    """The file of this board's last run; of the run that started last, when none is named.

    Raises StatisticsFileError when there is none, or this user may not look.
    """
    searched = list(directories())
    closed = [directory for directory in searched if _is_closed(directory)]
    for directory in (each for each in searched if each not in closed):
        named = directory.glob(f"*{SUFFIX}") if board is None else [directory / f"{board}{SUFFIX}"]
        found = [path for path in named if path.is_file()]
        if found:
            return max(found, key=lambda path: path.stat().st_mtime_ns)
    looked_in = ", ".join(str(each) for each in searched if each not in closed)
    fault = f"no statistics of {board or 'any board'} in {looked_in or 'any directory'}"
    if closed:
        raise StatisticsFileError(
            f"{fault}, and {closed[0]} is closed to this user",
            expected=f"root or a member of its group, {_group(closed[0])}",
        )
    is_file = board is not None and os.path.exists(board)  # noqa: PTH110 -- never raises
    hint = f", or --statistics {board} for that file" if is_file else ""
    raise StatisticsFileError(
        f"{fault}{not_looked_in()}", expected=f"a run in real time to have left some{hint}"
    )


def all_statistics(board: str | None = None) -> dict[str, Path]:
    """The files there are, by board, or that of one board, which may not be there yet."""
    for directory in directories():
        found = {path.stem: path for path in sorted(directory.glob(f"*{SUFFIX}"))}
        if board is None and found:
            return found
        if board in found:
            return {board: found[board]}
    return {} if board is None else {board: default_path(board)}


def places(board: str) -> Iterator[Path]:
    """Return where a board's statistics may be, whether they are there or not; nothing is made."""
    return (directory / f"{board}{SUFFIX}" for directory in directories())


def directories() -> Iterator[Path]:
    """The directories that are looked in, in that order; none that belongs to another user."""
    return (each for each in _every_directory() if owner_of_folder(each) is None)


def not_looked_in() -> str:
    """Return which directories are not, as others own them, to follow what was not found."""
    owners = ((each, owner_of_folder(each)) for each in _every_directory())
    said = [f"{each} belongs to {owner}" for each, owner in owners if owner is not None]
    return f", and {', '.join(said)}, and is not looked in" if said else ""


def looks_in_one_only() -> bool:
    """Return whether the environment states the one directory that runs leave anything in."""
    return bool(os.environ.get(_ALONE))


def is_of_session(directory: Path) -> bool:
    """Return whether it is gone when the user is: of a login session, or among temporary files."""
    if directory == SYSTEM or os.environ.get(_ALONE) or os.environ.get("RUNTIME_DIRECTORY"):
        return False
    of_session = os.environ.get("XDG_RUNTIME_DIR")
    if of_session and directory == Path(of_session, "firmware-runtime"):
        return True
    return directory == _temporary()


def _every_directory() -> Iterator[Path]:
    yield from _stated()
    if not os.environ.get(_ALONE):
        yield _temporary()


def _looked_in() -> Iterator[Path]:
    return (each for each in _stated() if owner_of_folder(each) is None)


def _stated() -> Iterator[Path]:
    """Those of them that the environment states; the last resort is none."""
    if stated := os.environ.get(_ALONE):
        yield Path(stated)
        return
    if of_unit := os.environ.get("RUNTIME_DIRECTORY"):
        yield Path(of_unit.split(":")[0])
    yield SYSTEM
    if of_session := os.environ.get("XDG_RUNTIME_DIR"):
        yield Path(of_session, "firmware-runtime")


def _is_closed(directory: Path) -> bool:
    """Return whether it is there and this user may not look into it."""
    return directory.is_dir() and not os.access(directory, os.R_OK | os.X_OK)


def _group(path: Path) -> str:
    try:
        return path.group()
    except KeyError:
        return str(path.stat().st_gid)


def _temporary() -> Path:
    stated = (os.environ.get(name, "") for name in ("TMPDIR", "TEMP", "TMP"))
    usable = (each for each in stated if os.access(each, os.W_OK | os.X_OK))
    place = next(usable, "/tmp")  # noqa: S108 -- the folder in it has to be this user's own
    return Path(place, f"firmware-runtime-{os.geteuid()}")


def _claimed(directory: Path) -> Path:
    """Make the directory ours, or refuse: any user may have put something of that name there."""
    directory.mkdir(mode=0o700, exist_ok=True)
    status = directory.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
        raise StatisticsFileError("belongs to another user", where=directory, expected="to own it")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        directory.chmod(0o700)
    return directory


class Companion(StrEnum):
    """Files that a run keeps beside its statistics, by their endings."""

    TAKEOVERS = ".guard"
    SETTINGS = ".settings"
    STARTS = ".starts"
    SAFE_STATE = ".safe-state"
    RECORDING = ".recording"
    SOCKET = ".socket"
    MEASURED = ".measured"

    def beside(self, statistics: Path) -> Path:
        """Return where a run keeps it that keeps its statistics at this path."""
        return statistics.with_suffix(self)


def of_guard(statistics: Path) -> Path:
    """The path that a guard's own companions stand beside, given the statistics of its run."""
    return statistics.with_stem(f"{statistics.stem}-guard")


def check_ending(statistics: Path) -> None:
    """Raise StatisticsFileError for a path that no statistics can have.

    That is one of what is no regular file or without a name, or one that ends as a companion does.
    """
    is_taken = "\0" in statistics.name or (
        os.path.exists(statistics) and not os.path.isfile(statistics)  # noqa: PTH110, PTH113
    )
    if not statistics.name or is_taken:
        raise StatisticsFileError("expected the path of a file", where=f"{str(statistics)!r}")
    if statistics.suffix in set(Companion):
        raise StatisticsFileError(
            f"expected another ending; {statistics.suffix} is for a file beside statistics",
            where=statistics,
        )
