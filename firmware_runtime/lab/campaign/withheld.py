"""Values that no longer come: how long ports of devices send nothing while outputs are on."""

from collections.abc import Mapping, Sequence
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.lab.campaign.watched import Look, Watched

_MOST: Final = SECOND
"""What sends less often is asked now and then, and need not be."""
_BEYOND: Final = 300 * MILLISECOND
_BEYOND_OF_A_FIELD: Final = 1800 * MILLISECOND
"""A driver may go on without a part of its values until it is sure that the part hangs."""
_TIMES: Final = 2


class Gaps:
    """How long each port has sent nothing at the most, in one run with outputs on all the while."""

    def __init__(self) -> None:
        self.longest: dict[str, int] = {}
        self._off_at = 0

    def look(self, look: Look, watched: Watched) -> None:
        """Take a look in."""
        if not look.is_on:
            self._off_at = look.at
            return
        for path, at in watched.last_sent().items():
            before = self.longest.get(path)
            sent_at = 0 if before is None else at  # until its first value it had sent nothing
            gap = look.at - max(sent_at, self._off_at)
            self.longest[path] = max(gap, before or 0)


def longest_of(runs: Sequence[Mapping[str, int]]) -> dict[str, int]:
    """The longest gap of each port that sends in all of these runs, and often."""
    paths = set(runs[0]).intersection(*runs)
    longest = {path: max(each[path] for each in runs) for path in sorted(paths)}
    return {path: gap for path, gap in longest.items() if gap <= _MOST}


def withheld(
    longest: Mapping[str, int], last_sent: Mapping[str, int], at: int, since: int
) -> str | None:
    """Return a sentence about a port that has sent nothing for much longer than its longest gap.

    Of the time since an instant, ns.
    """
    for path, usual in longest.items():
        gap = at - max(since, last_sent.get(path, 0))
        is_field = path.rpartition(".")[0] in longest
        if gap > _TIMES * usual + (_BEYOND_OF_A_FIELD if is_field else _BEYOND):
            said = f"{path} has sent nothing for {gap / SECOND:.2g} s"
            return f"{said}, {usual / SECOND:.2g} at the most when all is well"
    return None
