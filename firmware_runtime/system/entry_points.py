"""What other packages add: boards, rigs and commands, by their entry points.

What looks them up is imported when something is looked up: that takes some 17 ms, and many verbs
look up nothing.
"""

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

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
