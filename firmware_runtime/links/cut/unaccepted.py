"""Steps and values that the other end is not known to have: by its frames, which say what it has.

A path that loses steps towards the other end, and lets signs of life pass, leaves it working by
what is old. A newer value takes the place of one that was lost, but what is missing is so since the
first of them left: a path that loses every step of a stream is noticed like one that loses a single
one.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from firmware_runtime.links.cut.window import SHOWN, was_accepted
from firmware_runtime.links.cut.wire import NOTHING_MISSING, Frame, Missing

_MOST: Final = 1024
"""Values of a port, and frames with values, that are remembered."""


class _Sent(NamedTuple):
    counter: int
    at: int
    values: tuple[tuple[int, int], ...]
    """Port and sequence of each."""


class Unaccepted:
    """Values by port, and the frames that they were sent in; instants in ns by this end's clock."""

    __slots__ = ("_left", "_sent", "waits_since")

    def __init__(self) -> None:
        self.waits_since: int | None = None
        """When the oldest step was sent after the latest that was accepted; None: there is none."""
        self._left: dict[int, deque[Missing]] = {}
        self._sent: deque[_Sent] = deque(maxlen=_MOST)

    @property
    def oldest(self) -> Missing:
        """The value that may be missing for longest."""
        return min(
            (left[0] for left in self._left.values() if left), key=_since, default=NOTHING_MISSING
        )

    def put(self, port: int, sequence: int, origin: int) -> None:
        """Note a value that has left by a port."""
        left = self._left.setdefault(port, deque())
        if len(left) < _MOST:
            left.append(Missing(origin, sequence, port))

    def note_sent(self, counter: int, at: int, values: Iterable[tuple[int, int]]) -> None:
        """Note the port and sequence of each value that was sent in the frame with this counter."""
        self._sent.append(_Sent(counter, at, tuple(values)))
        if self.waits_since is None:
            self.waits_since = at

    def note(self, frame: Frame) -> None:
        """Note what the peer has accepted by one of its frames."""
        sent, seen, newest = self._sent, frame.seen, 0
        waiting: list[_Sent] = []
        while sent and sent[0].counter <= seen:
            each = sent.popleft()
            if was_accepted(each.counter, seen, frame.seen_before):
                newest = each.counter
                self._accept(each)
            elif each.counter >= seen - SHOWN:
                waiting.append(each)
        sent.extendleft(reversed(waiting))
        if newest > 0:
            self.waits_since = next((each.at for each in sent if each.counter > newest), None)

    def forget(self, port: int, before: int) -> None:
        """Forget what left by a port before an instant: it was given up long ago."""
        left = self._left.get(port)
        while left and left[0].since < before:
            left.popleft()

    def begin_again(self, waiting: Mapping[int, Iterable[tuple[int, int]]]) -> None:
        """Begin with another peer, which is to get what waits: sequence and origin, by port."""
        self._sent.clear()
        self.waits_since = None
        self._left = {
            port: deque(Missing(origin, sequence, port) for sequence, origin in each)
            for port, each in waiting.items()
        }

    def _accept(self, sent: _Sent) -> None:
        for port, sequence in sent.values:
            left = self._left.get(port)
            while left and left[0].sequence <= sequence:
                left.popleft()


def _since(missing: Missing) -> int:
    return missing.since
