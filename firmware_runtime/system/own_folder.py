"""Folders of this process: a temporary one, and one whose files appear all at once or not at all.

Its name says whose it is (`firmware-runtime-PID-START-...`, hidden where it is not among temporary
files), so what a process left behind that was killed is removed when the next one makes its own.
"""

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_runtime.system.this_process import (
    ProcessIdentity,
    boot_id,
    is_running,
    this_process,
)

_NAME = re.compile(r"\.?firmware-runtime-(\d+)-(\d+)-\w+")


@contextmanager
def own_folder(beside: Path | None = None) -> Iterator[Path]:
    """A folder that only this user can read, within the block.

    It is among the temporary files, or in the folder `beside` which files are to be moved to.
    """
    place = Path(tempfile.gettempdir()) if beside is None else beside
    hidden = "" if beside is None else "."
    _remove_leftovers(place, hidden)
    owner = this_process()
    prefix = f"{hidden}firmware-runtime-{owner.pid}-{owner.started_ticks or 0}-"
    with tempfile.TemporaryDirectory(prefix=prefix, dir=place) as folder:
        yield Path(folder)


def _remove_leftovers(place: Path, hidden: str) -> None:
    """Remove this user's folders whose owners are not running any more."""
    for path in place.glob(f"{hidden}firmware-runtime-*"):
        owner = _owner(path)
        if owner is not None and not is_running(owner):
            shutil.rmtree(path, ignore_errors=True)


def _owner(path: Path) -> ProcessIdentity | None:
    """The process that made this folder; None for what is no such folder of this user."""
    found = _NAME.fullmatch(path.name)
    if found is None or path.is_symlink() or not path.is_dir():
        return None
    if path.stat().st_uid != os.geteuid():
        return None
    return ProcessIdentity(int(found[1]), int(found[2]) or None, boot_id())


def nearest(folder: Path) -> Path:
    """The folder itself if it is there, or else the nearest place above it that is."""
    return next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """A place to gather files in; when the block ends well they are in `folder`, else nowhere.

    A folder that is there already keeps its other files; those of the same names are replaced,
    each at once. Raises OSError.
    """
    with own_folder(nearest(folder)) as own:
        gathered = own / "whole"
        gathered.mkdir()
        yield gathered
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists():
            for each in sorted(gathered.iterdir()):
                each.replace(folder / each.name)
        else:
            gathered.rename(folder)
