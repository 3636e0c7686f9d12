"""What other packages add: boards, rigs and commands, by their entry points."""

from functools import cache
from importlib.metadata import EntryPoint, entry_points


@cache
def installed(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of a group, each name once; nothing is imported yet.

    Looked up once a process: what is installed while it runs, the next one sees.
    """
    return tuple({each.name: each for each in reversed(_all(group))}.values())[::-1]


def providers(group: str, name: str) -> list[str]:
    """The packages that have an entry point of that name; more than one contradict each other."""
    found = (each.dist for each in _all(group) if each.name == name)
    return list(dict.fromkeys("?" if dist is None else dist.name for dist in found))


@cache
def _all(group: str) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=group))
