"""BASE and HEAD: two folders, or revisions of the git repository here, of which a copy is made.

Where the command is given within a folder of its repository, that folder of the revision is meant.
"""

import os
import subprocess
from pathlib import Path

from msgspec import Struct

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.packages import import_path


class Checkout(Struct, frozen=True):
    """One version of the program; `commit` is None for a folder, whatever is in it."""

    name: str
    stated: str
    folder: Path
    commit: str | None = None

    @property
    def path(self) -> list[str]:
        """Its folders with packages."""
        return [*map(str, import_path(self.folder))]

    @property
    def environment(self) -> dict[str, str]:
        """Environment of its processes: its packages first, and sets in the same order in both."""
        path = [*self.path, *filter(None, [os.environ.get("PYTHONPATH")])]
        own = {"PYTHONPATH": os.pathsep.join(path), "PYTHONHASHSEED": "0"}
        return {"OPENBLAS_NUM_THREADS": "1", **os.environ, **own}


def checkouts(base: str, head: str, into: Path) -> tuple[Checkout, Checkout]:
    """BASE and HEAD, copies in a folder. Raises ConfigError with what is wrong with either."""
    found: list[Checkout] = []
    faults = []
    for name, stated in (("BASE", base), ("HEAD", head)):
        try:
            found.append(_checkout(name, stated, into / name.lower()))
        except (OSError, subprocess.CalledProcessError):  # no git; git that has no such thing
            expected = "expected a folder, or a revision of the git repository with this folder"
            faults.append(f"{name} {stated}: neither a folder nor a revision; {expected}")
    if faults:
        raise ConfigError("gate", faults, f"gate: {faults[0]}" if len(faults) == 1 else None)
    return found[0], found[1]


def _checkout(name: str, stated: str, into: Path) -> Checkout:
    if Path(stated).is_dir():
        return Checkout(name, stated, Path(stated).resolve())
    found = _done("git", "rev-parse", "--verify", "--end-of-options", f"{stated}^{{commit}}")
    commit = found.decode().strip()
    into.mkdir()
    _done("tar", "-x", "-C", str(into), given=_done("git", "archive", "--format=tar", commit))
    return Checkout(name, stated, into, commit)


def _done(*command: str, given: bytes = b"") -> bytes:
    """Return what a program of the user's path prints. Raises CalledProcessError."""
    ended = subprocess.run(command, check=True, capture_output=True, input=given)  # noqa: S603
    return ended.stdout
