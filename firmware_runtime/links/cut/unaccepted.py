"""What left by each port after the newest that the other end has accepted: it may be missing there.

That end works by what is older. A newer value takes the place of one that was lost, but what
is missing is so since the first of them left: a path that loses every step of a stream is noticed
like one that loses a single one.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from firmware_runtime.links.cut.window import SHOWN, was_accepted
from firmware_runtime.links.cut.wire import NOTHING_MISSING, Frame, Missing

_MOST: Final = 1024
"""How many values of a port, and how many frames with values, are remembered."""


class _Sent(NamedTuple):
    counter: int
    port: int
    sequence: int


class Unaccepted:
    """Values by port, and the frames that they were sent in."""

    __slots__ = ("_left", "_sent")

    def __init__(self) -> None:
        self._left: dict[int, deque[Missing]] = {}
        self._sent: deque[_Sent] = deque(maxlen=_MOST)

    @property
    def oldest(self) -> Missing:
        """What may be missing for longest."""
        return min(
            (left[0] for left in self._left.values() if left), key=_since, default=NOTHING_MISSING
        )

    def put(self, port: int, sequence: int, origin: int) -> None:
        """Something has left by a port."""
        left = self._left.setdefault(port, deque())
        if len(left) < _MOST:
            left.append(Missing(origin, sequence, port))

    def note_sent(self, counter: int, port: int, sequence: int) -> None:
        """It was sent, in the frame with this counter."""
        self._sent.append(_Sent(counter, port, sequence))

    def note(self, frame: Frame) -> None:
        """The peer says what it has accepted."""
        sent, seen = self._sent, frame.seen
        waiting: list[_Sent] = []
        while sent and sent[0].counter <= seen:
            each = sent.popleft()
            if was_accepted(each.counter, seen, frame.seen_before):
                self._accept(each)
            elif each.counter >= seen - SHOWN:
                waiting.append(each)
        sent.extendleft(reversed(waiting))

    def forget(self, port: int, before: int) -> None:
        """Forget what left by a port before an instant: it was given up for long."""
        left = self._left.get(port)
        while left and left[0].since < before:
            left.popleft()

    def begin_again(self, waiting: Mapping[int, Iterable[tuple[int, int]]]) -> None:
        """There is another peer: it is to get what waits, by port, sequence and origin of each."""
        self._sent.clear()
        self._left = {
            port: deque(Missing(origin, sequence, port) for sequence, origin in each)
            for port, each in waiting.items()
        }

    def _accept(self, sent: _Sent) -> None:
        left = self._left.get(sent.port)
        while left and left[0].sequence <= sent.sequence:
            left.popleft()


def _since(missing: Missing) -> int:
    return missing.since
