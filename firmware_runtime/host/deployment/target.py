"""Target of a deployment: what it has, as `probe.sh` saw it, and what it lacks."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from firmware_runtime.system.packages import normal_name

MACHINES = ("aarch64", "x86_64")
LEAST_PYTHON = (3, 11)
GLIBC = (2, 28)
"""The C library that wheels may need; every Debian and Ubuntu with a Python of ours has a newer."""

_OLDEST_GLIBC = 17
"""Its minor version in manylinux2014, the oldest there is for aarch64."""


@dataclass(frozen=True, slots=True)
class Platform:
    """CPython of one version on one processor, under Linux with glibc."""

    machine: str
    python: tuple[int, int]

    def __str__(self) -> str:
        return f"{self.interpreter}-{self.machine}"

    @property
    def interpreter(self) -> str:
        """As in a wheel's name: `cp311`."""
        return f"cp{self.python[0]}{self.python[1]}"

    @property
    def tags(self) -> list[str]:
        """The platforms a wheel may be built for, the newest first."""
        newest = GLIBC[1]
        versions = [f"manylinux_2_{minor}" for minor in range(newest, _OLDEST_GLIBC - 1, -1)]
        return [f"{version}_{self.machine}" for version in [*versions, "manylinux2014"]]

    @property
    def pip_options(self) -> list[str]:
        """Options of `pip download`; it takes wheels only."""
        options = ["--only-binary=:all:", "--implementation=cp"]
        options += [f"--python-version={self.python[0]}.{self.python[1]}"]
        options += [f"--abi={abi}" for abi in (self.interpreter, "abi3", "none")]
        return [*options, *(f"--platform={tag}" for tag in self.tags)]

    def takes(self, file_name: str) -> bool:
        """Return whether a wheel of this name can be installed there."""
        stem, _, suffix = file_name.rpartition(".")
        words = stem.split("-")
        if suffix != "whl" or len(words) < 5:
            return False
        pythons, abis, platforms = (word.split(".") for word in words[-3:])
        fitting = self._pythons_and_abis()
        return not {"any", *self.tags}.isdisjoint(platforms) and any(
            pair in fitting for pair in product(pythons, abis)
        )

    def _pythons_and_abis(self) -> set[tuple[str, str]]:
        minors = range(self.python[1] + 1)
        return {
            ("py3", "none"),
            (self.interpreter, "none"),
            (self.interpreter, self.interpreter),
            *((f"py3{minor}", "none") for minor in minors),
            *((f"cp3{minor}", "abi3") for minor in minors),
        }


ROOM_KIB = 500 * 1024
"""The new version beside those that are there."""

_HOW_TO_HAVE = (
    "expected the board's device: enable the controller (dtparam=i2c_arm=on in "
    "/boot/firmware/config.txt), load i2c-dev, plug the adapter in; or --force"
)
_SUPPORTED = f"{LEAST_PYTHON[0]}.{LEAST_PYTHON[1]} or later"


class Need(NamedTuple):
    """What a deployment needs of a target, and what it brings."""

    sends: bool = True
    """Whether it sends a version; else it goes to one that is there."""
    devices: bool = True
    """Whether the board's devices have to be there."""
    signed: bool = False


_ALL = Need()


@dataclass(frozen=True, slots=True)
class Target:
    """The answers to the probe; an empty one means that there is none."""

    machine: str
    python: str
    bits: str
    base: str
    """The path of that Python itself, where one of an environment was named."""
    magic: str
    """Of its bytecode, in hexadecimal."""
    packages: str
    """The packages that it has, each as NAME==VERSION, with blanks between."""
    glibc: str
    rsync: str
    free_kib: str
    superuser: str
    """`root` or `sudo`."""
    writable: str
    systemd: str
    foreign: str
    """What stands where the link to the program belongs."""
    board: str
    """The one that is deployed, where none was named that of the last update."""
    settings: str
    """The board's settings, on the target."""
    versions: str
    """The versions that it has, as `list_versions` prints them, each with a ; behind it."""
    signers: str
    """The file of those whose signatures it asks for, if it does."""
    armed: str
    """Its robots that are armed, with blanks between."""
    lacking: str
    """The board's device nodes that are not there, with blanks between."""
    kinds: str
    """The kinds of board that are installed there, with blanks between."""

    @classmethod
    def read(cls, printed: str) -> "Target":
        """Read what the probe printed; what it did not print is empty."""
        answers = dict.fromkeys(cls.__slots__, "")
        for line in printed.splitlines():
            key, _, value = line.partition(" ")
            if key in answers:
                answers[key] = value.strip()
        return cls(**answers)

    @property
    def platform(self) -> Platform:
        """Return what wheels have to fit."""
        major, minor = _version(self.python)
        return Platform(self.machine, (major, minor))

    @property
    def minor_version(self) -> str:
        """Return the version of its Python that names folders: `3.11`."""
        return "{}.{}".format(*self.platform.python)

    @property
    def system_packages(self) -> dict[str, str]:
        """Return the versions of the packages that its Python has, by their normal names."""
        pairs = (each.partition("==") for each in self.packages.split())
        return {normal_name(name): version for name, _, version in pairs}

    @property
    def markers(self) -> dict[str, str]:
        """Return what the conditions of requirements ask for (PEP 508)."""
        return {
            "implementation_name": "cpython",
            "implementation_version": self.python,
            "os_name": "posix",
            "platform_machine": self.machine,
            "platform_python_implementation": "CPython",
            "platform_system": "Linux",
            "python_full_version": self.python,
            "python_version": self.minor_version,
            "sys_platform": "linux",
        }

    def text(self) -> str:
        """Return what it is, in a line."""
        parts = [self.machine, f"Python {self.python}", f"glibc {self.glibc}"]
        parts += [f"{int(self.free_kib) / 1024**2:.1f} GiB free"]
        if self.superuser:
            parts += ["as root" if self.superuser == "root" else "root by sudo"]
        return ", ".join(parts)

    def faults(self, python: str, root: str, need: Need = _ALL) -> list[str]:
        """Everything that it lacks, one sentence each; below a `root` it takes less."""
        new = (*self._lacks_for_wheels(python), *self._lacks_a_signature(need))
        return [
            *(new if need.sends else self._lacks_a_board()),
            *(self._lacks_below(root) if root else self._lacks_as_a_robot()),
            *(self._lacks_devices() if need.devices else ()),
        ]

    def _lacks_a_board(self) -> Iterator[str]:
        if not self.board:
            yield "no update before that says which board; expected BOARD"

    def _lacks_devices(self) -> Iterator[str]:
        for node in self.lacking.split():
            yield f"{node}: not there; {_HOW_TO_HAVE}"

    def _lacks_a_signature(self, need: Need) -> Iterator[str]:
        if self.signers and not need.signed:
            yield f"{self.signers} is there: it takes no version that is not signed; --sign KEY"

    def _lacks_for_wheels(self, python: str) -> Iterator[str]:
        if self.machine not in MACHINES:
            yield f"processor {self.machine}; expected one of {', '.join(MACHINES)}"
        if not self.python:
            yield f"{python}: not found; expected Python {_SUPPORTED} (Debian package python3)"
        elif _version(self.python) < LEAST_PYTHON:
            yield f"{python} is {self.python}; expected {_SUPPORTED}; --python PATH names another"
        elif self.bits != "64":
            yield f"{python} is a 32-bit program; expected a 64-bit system"
        elif not (self.base and self.magic):
            yield f"{python} is not whole; install Debian package python3"
        if not self.glibc or _version(self.glibc) < GLIBC:
            found = self.glibc or "none"
            yield f"glibc: {found}; expected {GLIBC[0]}.{GLIBC[1]} or newer, as the wheels need"
        if not self.rsync:
            yield "rsync: not found; install Debian package rsync"
        if int(self.free_kib or 0) < ROOM_KIB:
            free = int(self.free_kib or 0) // 1024
            yield f"{free} MiB free for /opt/firmware-runtime; expected {ROOM_KIB // 1024}"

    def _lacks_as_a_robot(self) -> Iterator[str]:
        for board in self.armed.split():
            yield f"{board} is armed, expected it disarmed: firmware-runtime disarm {board}"
        if not self.superuser:
            yield (
                "neither root nor sudo without a password; log in as root, or install Debian "
                "package sudo and allow this user NOPASSWD"
            )
        if not self.systemd:
            yield "systemd does not run it; expected it to, or --root DIR to try without"
        yield from self._lacks_a_free_place()

    def _lacks_below(self, root: str) -> Iterator[str]:
        if not self.writable:
            yield f"{root}: this user may not write there"
        yield from self._lacks_a_free_place()

    def _lacks_a_free_place(self) -> Iterator[str]:
        if self.foreign:
            yield f"{self.foreign}: no link that a deployment made; move it away"


def _version(text: str) -> tuple[int, int]:
    major, minor = text.split(".")[:2]
    return int(major), int(minor)
