"""Packages installed here: their entry points, the extras of this one, and what a run refuses.

`importlib.metadata` is imported when something is looked up: that takes some 17 ms, and many verbs
look up nothing. rclpy's wheels start every interpreter of their environment twice, and bring a
hundred packages that a run does not need: the node of ROS 2 has an environment of its own. What
PYTHONPATH adds, as in a shell that has sourced ROS, is in no environment: a run imports none of it.
"""

import os
import shlex
import site
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from firmware_runtime.errors import ConfigError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints


@cache
def installed(group: str) -> "tuple[EntryPoint, ...]":
    """The entry points of a group, each name once; nothing is imported yet.

    Looked up once a process: what is installed while it runs, the next one sees.
    """
    return tuple({each.name: each for each in reversed(_of(group))}.values())[::-1]


def of_every_package(group: str) -> "list[tuple[str, EntryPoint]]":
    """The entry points of a group with their packages' names; two packages may share a name."""
    found = {}
    for each in _of(group):
        package = "?" if each.dist is None else each.dist.name
        found[package, each.name] = package, each
    return [*found.values()]


def rivals(group: str, name: str) -> list[str]:
    """The packages that have an entry point of that name, where that is more than one."""
    found = [each.dist for each in _of(group) if each.name == name]
    if len(found) == 1:  # the name of its package would be read from a file
        return []
    names = list(dict.fromkeys("?" if dist is None else dist.name for dist in found))
    return names if len(names) > 1 else []


def _of(group: str) -> "list[EntryPoint]":
    return list(_all().select(group=group))


@cache
def _all() -> "EntryPoints":
    """Of every group: to find those of one, the files of every package are read as well."""
    found: EntryPoints = import_module("importlib.metadata").entry_points()
    return found


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
    return shlex.join([sys.executable, "-m", "pip", "install", *wanted])


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


def _holds_packages(folder: Path) -> bool:
    if folder.name.startswith(".") or (folder / "__init__.py").exists():
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
