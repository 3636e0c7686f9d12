"""What `/diagnostics` says of a node's topics: its counts of messages, and a level by these rules.

    OK      every message was carried in the last 10 s
    WARN    one was not: its value was refused or found no room, or it could not be published

Messages for a node that is not active are counted, and nothing is wrong with that. Without ROS.
"""

from collections import Counter, deque
from collections.abc import Mapping
from typing import Final

from firmware_runtime.links.ros2.judgement import LATELY, Level, Status

_WRONG: Final = ("refused", "dropped", "failed")


class TopicJudge:
    """Judges the counts of one node's topics again and again; remembers those of 10 s ago."""

    def __init__(self, board: str) -> None:
        self._name = f"{board}: topics"
        self._before: deque[tuple[int, Counter[str]]] = deque()

    def judge(self, counts: Mapping[str, int], now: int) -> list[Status]:
        """The status; none before the first message. `now` is any clock in ns."""
        if not counts:
            return []
        self._before.append((now, Counter(counts)))
        while now - self._before[0][0] > LATELY:
            self._before.popleft()
        lately = {name: counts.get(name, 0) - self._before[0][1][name] for name in _WRONG}
        wrong = [f"{count} {name}" for name, count in lately.items() if count > 0]
        level = Level.WARN if wrong else Level.OK
        message = f"in the last 10 s: {', '.join(wrong)}" if wrong else "every message is carried"
        return [Status(self._name, level, message, {key: str(n) for key, n in counts.items()})]
