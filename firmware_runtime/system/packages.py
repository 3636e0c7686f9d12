"""Packages installed here: their entry points, the extras of this one, and what a run refuses.

Metadata of packages is read from their folders on `sys.path` (`NAME-VERSION.dist-info`) line by
line: what `importlib.metadata` imports to do that takes longer than a third of a start. rclpy's
wheels start every interpreter of their environment twice, and bring a hundred packages that a run
does not need: the node of ROS 2 has an environment of its own. What PYTHONPATH adds, as in a shell
that has sourced ROS, is in no environment: a run imports none of it.

Source: packaging.python.org, Core metadata specifications; Entry points specification.
"""

import os
import re
import site
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

from firmware_runtime.errors import ConfigError

_VALUE: Final = r"([\w.]+)\s*(:\s*([\w.]+))?\s*(\[.*\])?"
"""`module`, `module:attribute`, either with extras in brackets behind it."""


class EntryPoint(NamedTuple):
    """An object that a package makes known under a name, in a group."""

    name: str
    value: str
    group: str
    folder: str
    """The package's metadata."""

    @property
    def is_sound(self) -> bool:
        """True if the value has the form MODULE or MODULE:OBJECT."""
        return re.fullmatch(_VALUE, self.value) is not None

    @property
    def module(self) -> str:
        """The module that the object is in."""
        return self.value.partition(":")[0].partition("[")[0].strip()

    @property
    def package(self) -> str:
        """The name of the package, as it spells it."""
        return _field(self.folder, "Name") or "?"

    def load(self) -> Any:  # noqa: ANN401 -- whatever the package has there
        """Import the object. Raises ImportError or AttributeError, or what its module raises."""
        found: object = import_module(self.module)
        for name in self.value.partition(":")[2].partition("[")[0].split("."):
            found = getattr(found, name.strip()) if name.strip() else found
        return found


@cache
def installed(group: str) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, each name once; nothing is imported yet.

    Looked up once a process: what is installed while it runs, the next one sees.
    """
    return tuple({each.name: each for each in reversed(_of(group))}.values())[::-1]


def of_every_package(group: str) -> list[tuple[str, EntryPoint]]:
    """Return the entry points of a group with their packages' names; two may share a name."""
    return [*{(each.package, each.name): (each.package, each) for each in _of(group)}.values()]


def rivals(group: str, name: str) -> list[str]:
    """Return the packages that have an entry point of that name, where there are several."""
    found = [each for each in _of(group) if each.name == name]
    names = [*dict.fromkeys(each.package for each in found)] if len(found) > 1 else []
    return names if len(names) > 1 else []


def version_of(package: str) -> str | None:
    """Return the version of a package that is installed here; None if it is not."""
    folder = _folders().get(normal_name(package))
    return None if folder is None else _field(folder, "Version")


def _of(group: str) -> list[EntryPoint]:
    return [each for each in _all() if each.group == group]


@cache
def _all() -> list[EntryPoint]:
    return [each for folder in _folders().values() for each in _entry_points(folder)]


def _entry_points(folder: str) -> Iterator[EntryPoint]:
    group = ""
    for line in map(str.strip, _lines(f"{folder}/entry_points.txt")):
        if line.startswith("[") and line.endswith("]"):
            group = line[1:-1]
        elif line and not line.startswith("#"):
            name, _, value = line.partition("=")
            yield EntryPoint(name.strip(), value.strip(), group, folder)


@cache
def _folders() -> dict[str, str]:
    """Return the metadata folder of each package; of two of a name the first on `sys.path`."""
    found: dict[str, str] = {}
    for place in sys.path:
        with suppress(OSError):
            for name in sorted(os.listdir(place or ".")):  # noqa: PTH208 -- of texts
                if name.endswith((".dist-info", ".egg-info")):
                    found.setdefault(normal_name(name.split("-")[0]), f"{place or '.'}/{name}")
    return found


def _field(folder: str, name: str) -> str | None:
    """Return a field of a package's metadata; they end with the first blank line."""
    file = "PKG-INFO" if folder.endswith(".egg-info") else "METADATA"
    for line in _lines(f"{folder}/{file}"):
        key, _, value = line.partition(":")
        if key.casefold() == name.casefold():
            return value.strip()
        if not line.strip():
            break
    return None


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text("utf-8", "replace").splitlines()
    except OSError:
        return []


def normal_name(name: str) -> str:
    """Return the name of a package in the form in which two are compared."""
    return re.sub(r"[-_.]+", "-", name.removesuffix(".egg")).lower()


def install_command(extra: str) -> str:
    """Return the command that installs what an extra lists, for the Python that is running.

    The project is on no package index, so it cannot be installed from one by name, and installing
    its folder would replace an editable installation. What the extra lists is on the index.
    """
    listed = [
        each.partition(";")
        for each in import_module("importlib.metadata").requires("firmware-runtime") or ()
    ]
    wanted = [
        package.strip()
        for package, _, condition in listed
        if f"extra == '{extra}'" in condition.replace('"', "'")
    ]
    from shlex import join  # noqa: PLC0415 -- of a fault only

    return join([sys.executable, "-m", "pip", "install", *wanted])


def module_of_extra(name: str, extra: str) -> ModuleType:
    """Import a module of this project. Raises ConfigError, with the command, without the extra."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and error.name.startswith("firmware_runtime"):
            raise
        raise ConfigError(
            error.name or name,
            [f"not installed; expected the extra {extra}: {install_command(extra)}"],
        ) from error


def import_path(checkout: Path) -> list[Path]:
    """Return `src` and the folders directly in a checkout that hold packages; then itself.

    A folder that is a package is imported from the checkout itself; what lies deeper, such as in
    an environment or in another checkout, is not its own.
    """
    inside = sorted(each for each in checkout.iterdir() if each.is_dir())
    return [*(each for each in inside if _holds_packages(each)), checkout]


_OF_OTHERS = ("__init__.py", "pyproject.toml")
"""Files of a folder that is imported from where it is, and of another checkout."""


def _holds_packages(folder: Path) -> bool:
    if folder.name.startswith(".") or any((folder / each).exists() for each in _OF_OTHERS):
        return False
    return folder.name == "src" or any(folder.glob("*/__init__.py"))


def refuse_ros() -> None:
    """Raise ConfigError where rclpy is installed beside this project; 20 us."""
    for folder in site.getsitepackages():
        if os.path.isdir(f"{folder}/rclpy"):  # noqa: PTH112 -- pathlib takes three times as long
            raise ConfigError.of_one(
                folder,
                "has rclpy",
                expected="a run in an environment without it, and the node of ROS 2 in one of "
                "its own: docs/ros2.md",
            )
