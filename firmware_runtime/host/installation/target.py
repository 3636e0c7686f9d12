"""The system that is installed into: its files, programs and units.

Files lie below a root: `/` on the robot itself, any directory for a system that is being built.
Every path is the one on the robot, such as `/etc/firmware-runtime/tachobot.toml`.
"""

import os
import re
import shlex
import shutil
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import firmware_runtime
from firmware_runtime.errors import InstallationRefused, StepFailed
from firmware_runtime.host.installation.plan import PROGRAM
from firmware_runtime.system.atomic_file import replace_file
from firmware_runtime.system.programs import ProgramFailed, answer_of

_DIRECTORY_MODE = 0o755
_MADE_HERE = ("firmware-runtime", "sysusers.d")
"""How the names of directories begin that are ours; Debian's systemd ships no /etc/sysusers.d."""


@dataclass(frozen=True, slots=True)
class Tree:
    """The system's files. Whatever cannot be done raises StepFailed."""

    root: Path = Path("/")

    def where(self, path: str) -> Path:
        """Return where a file really is."""
        return self.root / path.lstrip("/")

    def content(self, path: str) -> bytes | None:
        """Return what is in a file; None if there is none."""
        place = self.where(path)
        with _explained(place, "read"), suppress(FileNotFoundError):
            return place.read_bytes()
        return None

    def exists(self, path: str) -> bool:
        """Return whether there is a file, a directory or a link of that name."""
        return os.path.lexists(self.where(path))

    def mode(self, path: str) -> int:
        """The permissions of a file."""
        return self.where(path).stat().st_mode & 0o7777

    def names(self, directory: str) -> list[str]:
        """Return what lies in a directory, in order; nothing if it is not there."""
        place = self.where(directory)
        with _explained(place, "read"), suppress(FileNotFoundError):
            return sorted(each.name for each in place.iterdir())
        return []

    def write(self, path: str, content: bytes, mode: int) -> None:
        """Put a file in place, durably, and the directories above it."""
        place = self.where(path)
        with _explained(place, "written"):
            _make_directory(place.parent)
            replace_file(place, content, mode, synced=True)

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


THIS_MACHINE = Path("/")
_SYSTEMD_RUNS = "/run/systemd/system"
_DEVICE_MANAGER_LISTENS = "/run/udev/control"


@dataclass(frozen=True, slots=True)
class Target:
    """A tree of files; `is_live` is whether systemd runs on it and is to be reloaded."""

    tree: Tree = field(default_factory=Tree)
    is_live: bool = False

    @property
    def has_device_manager(self) -> bool:
        """True if udev runs; it does not in a container."""
        return self.tree.exists(_DEVICE_MANAGER_LISTENS)


def target(root: Path | None, *, dry_run: bool) -> Target:
    """The directory, or this machine if there is none. Raises InstallationRefused.

    Looking at what would be done takes neither root nor systemd.
    """
    if root is not None:
        return Target(Tree(root.absolute()))
    machine = Target(Tree(THIS_MACHINE), is_live=True)
    if not dry_run:
        require_systemd(", or --root DIR to change the files of one that is being built")
        if os.geteuid() != 0:
            raise InstallationRefused(
                "this user may not change the system's files",
                expected="root: use sudo, or --root DIR to write elsewhere, or --dry-run to "
                "see what would be done",
            )
    return machine


def require_systemd(or_else: str = "") -> None:
    """Raise InstallationRefused where systemd does not run; `or_else` is another way, if any."""
    if not Tree(THIS_MACHINE).exists(_SYSTEMD_RUNS):
        raise InstallationRefused(
            f"systemd does not run this machine (no {_SYSTEMD_RUNS})",
            expected=f"a system that it runs{or_else}",
        )


Words = Sequence[str]


def run(words: Words, log: Callable[[str], None]) -> None:
    """Show a command and run it to its end. Raises StepFailed."""
    log(f"$ {shlex.join(words)}")
    answer(words)


def answer(words: Words) -> str:
    """Return what a command prints. Raises StepFailed."""
    try:
        return answer_of(words)
    except ProgramFailed as error:
        raise StepFailed(str(error)) from error


HIDDEN = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")  # noqa: S108 -- nothing is put there
"""What ProtectHome= and PrivateTmp= hide."""
_PLAIN = re.compile(r"/[A-Za-z0-9_.+@%/-]+")
_REMEDY = f"install it into {Path(PROGRAM).parents[1]}, or name another program with --program PATH"


def own_program(package: Path) -> str:
    """The installed program of this interpreter; `package` is a file of the board's package.

    Raises InstallationRefused, also if that package is one that a service would not see.
    """
    program = Path(sysconfig.get_path("scripts"), "firmware-runtime")
    python, runtime = Path(sys.executable).resolve(), Path(firmware_runtime.__file__)
    refuse_hidden([program, python, runtime, package])
    return runnable(str(program))


def runnable(program: str) -> str:
    """This program, which is there and can be run. Raises InstallationRefused."""
    if not os.access(program, os.X_OK):
        raise InstallationRefused(f"is no program that can be run; {_REMEDY}", where=program)
    return checked(program)


def checked(program: str) -> str:
    """This program, whose path can stand in a unit. Raises InstallationRefused."""
    if _PLAIN.fullmatch(program) is None:
        raise InstallationRefused(
            "cannot stand in a unit",
            where=f"{program!r}",
            expected="an absolute path without spaces",
        )
    refuse_hidden([Path(program)])
    return program


def refuse_hidden(parts: Iterable[Path]) -> None:
    """Raise InstallationRefused if a service would not see one of these."""
    for part in parts:
        for hidden in HIDDEN:
            if part.is_relative_to(hidden):
                raise InstallationRefused(
                    f"lies below {hidden}, which is hidden from a service; {_REMEDY}", where=part
                )


_PROPERTIES = {
    "ActiveState": "active",
    "SubState": "sub",
    "ActiveEnterTimestamp": "since",
    "MainPID": "pid",
    "NRestarts": "restarts",
    "WatchdogUSec": "watchdog",
    "Result": "result",
    "UnitFileState": "enabled",
    "StatusText": "says",
}


@dataclass(frozen=True, slots=True)
class UnitState:
    """A unit, in systemd's own words; empty where it has none."""

    unit: str
    active: str
    sub: str
    since: str
    pid: int
    restarts: int
    watchdog: str
    result: str
    enabled: str
    says: str

    @property
    def is_active(self) -> bool:
        """True if it runs and is ready, or is reading its settings again."""
        return self.active in {"active", "reloading"}


def state_of(unit: str) -> UnitState:
    """Query systemd. Raises StepFailed when it cannot be reached."""
    printed = answer(("systemctl", "show", unit, f"--property={','.join(_PROPERTIES)}"))
    return parse(unit, dict(line.partition("=")[::2] for line in printed.splitlines()))


def parse(unit: str, properties: Mapping[str, str]) -> UnitState:
    """A unit from what `systemctl show` prints, by name."""
    words = {name: properties.get(key, "") for key, name in _PROPERTIES.items()}
    pid, restarts = int(words.pop("pid") or 0), int(words.pop("restarts") or 0)
    return UnitState(unit=unit, pid=pid, restarts=restarts, **words)
