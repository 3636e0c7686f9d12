"""The runs that may drive a board's outputs: at the path that is expected, or found by /proc.

A run keeps its buses locked and its statistics open. So whatever path it was given for these, the
processes that have the board's lines open lead to it, as far as this user may look into them.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.registry import Board
from firmware_runtime.runs.watched_run import WatchedRun
from firmware_runtime.statistics.file_header import STATISTICS

if TYPE_CHECKING:
    from firmware_runtime.system.device_nodes import Holder


def lines_of(board: Board, doubles: Path | None) -> list[str]:
    """Return what a run of this board locks: device nodes, or the file for its doubles."""
    if doubles is not None:
        # of doubles in another process only
        from firmware_runtime.hal.served.connection import lock_of  # noqa: PLC0415

        return [str(lock_of(doubles.resolve()))]
    return [line.device for line in (board.settings.buses | board.ports).values()]


def run_at(statistics: Path, places: Sequence[str]) -> WatchedRun | None:
    """The run that keeps its statistics there, if it lives and drives what hangs on these lines.

    `places` are what its outputs begin with: device nodes, or the socket of doubles. Raises
    StatisticsFileError for a file that is of no use.
    """
    run = WatchedRun(statistics)
    theirs = run.conditions.get("switched_off", ())
    beginnings = tuple(f"{place}{end}" for place in places for end in " :")
    meant = any(str(each).startswith(beginnings) for each in theirs)
    if run.drives and meant:
        return run
    run.close()
    return None


def holders_of(lines: Sequence[str]) -> "list[Holder]":
    """The processes that have these lines open, as far as this user may look into them."""
    # looked for once outputs are off
    from firmware_runtime.system.device_nodes import holders  # noqa: PLC0415
    from firmware_runtime.system.kernel_files import THIS_MACHINE  # noqa: PLC0415

    return holders(THIS_MACHINE, lines).found


def statistics_of(found: "Iterable[Holder]") -> Iterator[tuple[Path, Path]]:
    """The statistics that these processes keep open.

    Each as a path to the very file, by its descriptor, and as the path that it had when opened.
    """
    for process in sorted({each.process for each in found}):
        yield from _statistics_of(Path("/proc", str(process)))


def folders_of_runs() -> list[Path]:
    """Return where all processes keep statistics open, as far as this user may see."""
    from firmware_runtime.system.kernel_files import THIS_MACHINE  # noqa: PLC0415 -- as above

    processes = (Path(each) for each in THIS_MACHINE.matching("/proc/[0-9]*"))
    return sorted({name.parent for each in processes for _, name in _statistics_of(each)})


def _statistics_of(process: Path) -> Iterator[tuple[Path, Path]]:
    with suppress(OSError):
        for descriptor in (process / "fd").iterdir():
            with suppress(OSError):
                name = Path(str(descriptor.readlink()).removesuffix(" (deleted)"))
                if name.is_absolute() and _is_statistics(descriptor):
                    yield descriptor, name


def is_driven(lines: Sequence[str]) -> bool:
    """Return whether a process has one of these lines locked, as a run has all of its.

    One that this user may not open counts as locked: nothing can be known of it.
    """
    return any(_is_locked(line) for line in lines)


def _is_locked(line: str) -> bool:
    try:
        # read only, since a lock takes no more: another user's may be no more than readable
        descriptor = os.open(line, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except PermissionError:
        return True
    except OSError:
        return False
    try:
        flock(descriptor, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False


def _is_statistics(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(STATISTICS.magic)) == STATISTICS.magic
