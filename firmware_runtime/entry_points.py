"""What other packages add: boards, rigs and commands, by their entry points."""

from functools import cache
from importlib.metadata import EntryPoint, entry_points


@cache
def installed(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of a group, each name once; nothing is imported yet.

    Looked up once a process: what is installed while it runs, the next one sees.
    """
    return tuple({each.name: each for each in entry_points(group=group)}.values())
