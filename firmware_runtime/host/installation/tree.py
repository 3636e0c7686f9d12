"""Files below a root: `/` on the robot itself, any directory for a system that is being built.

Every path is the one on the robot, such as `/etc/firmware-runtime/tachobot.toml`. A file is written
under another name first, so that a reader gets the old one or the new one, whole.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.errors import StepFailed

_DIRECTORY_MODE = 0o755
_MADE_HERE = ("firmware-runtime", "sysusers.d")
"""How the names of directories begin that are ours; Debian's systemd ships no /etc/sysusers.d."""


@dataclass(frozen=True, slots=True)
class Tree:
    """The system's files. Whatever cannot be done raises StepFailed."""

    root: Path = Path("/")

    def where(self, path: str) -> Path:
        """Where a file really is."""
        return self.root / path.lstrip("/")

    def content(self, path: str) -> bytes | None:
        """What is in a file; None if there is none."""
        place = self.where(path)
        with _explained(place, "read"), suppress(FileNotFoundError):
            return place.read_bytes()
        return None

    def exists(self, path: str) -> bool:
        """Whether there is a file, a directory or a link of that name."""
        return os.path.lexists(self.where(path))

    def mode(self, path: str) -> int:
        """The permissions of a file."""
        return self.where(path).stat().st_mode & 0o7777

    def names(self, directory: str) -> list[str]:
        """What lies in a directory, in order; nothing if it is not there."""
        place = self.where(directory)
        with _explained(place, "read"), suppress(FileNotFoundError):
            return sorted(each.name for each in place.iterdir())
        return []

    def write(self, path: str, content: bytes, mode: int) -> None:
        """Put a file in place, durably, and the directories above it."""
        place = self.where(path)
        unfinished = place.with_name(f".{place.name}.{os.getpid()}")
        with _explained(place, "written"):
            _make_directory(place.parent)
            try:
                with unfinished.open("wb") as file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
                unfinished.chmod(mode)
                unfinished.replace(place)
            finally:
                unfinished.unlink(missing_ok=True)

    def link(self, path: str, to: str) -> None:
        """Make a symbolic link to another path on the robot."""
        place = self.where(path)
        with _explained(place, "linked"):
            _make_directory(place.parent)
            place.unlink(missing_ok=True)
            place.symlink_to(to)

    def remove(self, path: str) -> None:
        """Remove a file, a link, or a directory with everything in it; and its directory if empty.

        Only a directory that an installation makes goes too: all others are the system's.
        """
        place = self.where(path)
        with _explained(place, "removed"):
            if place.is_dir() and not place.is_symlink():
                shutil.rmtree(place)
            else:
                place.unlink(missing_ok=True)
            if place.parent.name.startswith(_MADE_HERE):
                with suppress(OSError):  # another file is in it
                    place.parent.rmdir()


def _make_directory(path: Path) -> None:
    """Like mkdir -p, open to readers whatever this user's umask is."""
    missing = [each for each in (path, *path.parents) if not each.exists()]
    for each in reversed(missing):
        each.mkdir()
        each.chmod(_DIRECTORY_MODE)


@contextmanager
def _explained(place: Path, action: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise StepFailed(f"cannot be {action} ({error.strerror})", where=place) from error
