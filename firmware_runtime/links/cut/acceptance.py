"""Whether the steps that an end sends arrive: frames may pass from the peer, and none to it.

Every frame of the peer says which frames it has accepted. A path that loses steps towards it, and
lets signs of life pass, leaves it working by what is old.
"""

from collections import deque
from typing import Final

from firmware_runtime.links.cut.window import SHOWN, was_accepted
from firmware_runtime.links.cut.wire import Frame

_MOST: Final = 1024
"""How many frames are remembered; of more, the oldest are forgotten."""


class Acceptance:
    """Steps on their way; instants are in ns, by this end's clock."""

    __slots__ = ("_sent", "waits_since")

    def __init__(self) -> None:
        self.waits_since: int | None = None
        """When the oldest step was sent after the latest that was accepted; None: there is none."""
        self._sent: deque[tuple[int, int]] = deque(maxlen=_MOST)

    def note_sent(self, counter: int, at: int) -> None:
        """A step was sent, in the frame with this counter."""
        self._sent.append((counter, at))
        if self.waits_since is None:
            self.waits_since = at

    def note(self, frame: Frame) -> None:
        """The peer says what it has accepted."""
        newest = self._newest_accepted(frame)
        if newest is None:
            return
        while self._sent and self._sent[0][0] <= newest:
            self._sent.popleft()
        self.waits_since = self._sent[0][1] if self._sent else None

    def begin_again(self) -> None:
        """There is another peer: nothing is on its way to it."""
        self._sent.clear()
        self.waits_since = None

    def _newest_accepted(self, frame: Frame) -> int | None:
        """The highest of the counters that the frame accepts; it shows none far below `seen`."""
        for counter, _ in reversed(self._sent):
            if was_accepted(counter, frame.seen, frame.seen_before):
                return counter
            if counter < frame.seen - SHOWN:
                break
        return None
