"""Numbers of one session that have been accepted: the highest, and those just below it.

As in IPsec (RFC 4303): a number that has not been seen yet is accepted also if higher ones came
before it, as long as it is not further below the highest than the window reaches.
"""

from typing import Final

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.links.cut.refusal import Reason, Refused

SIZE: Final = 1024
"""How many numbers below the highest are remembered one by one."""
SHOWN: Final = 64
"""Of how many of them a frame says whether they were accepted."""
RECENT: Final = 200 * MILLISECOND
"""A frame below the window that was sent so shortly before the newest comes from no sender in
order; one that is older may be a recorded one."""
_MASK: Final = (1 << SIZE) - 1


class Seen:
    """`highest` is 0 before the first; bit n of `before`: `highest` - 1 - n was seen, too."""

    __slots__ = ("before", "highest")

    def __init__(self) -> None:
        self.highest = 0
        self.before = 0

    def has(self, number: int) -> bool:
        """Return whether it has been seen, as far back as is remembered."""
        return _is_among(number, self.highest, self.before, SIZE)

    def note(self, number: int) -> None:
        """It has been seen."""
        ahead = number - self.highest
        if ahead > 0:
            if self.highest > 0:
                self.before = (self.before << ahead | 1 << ahead - 1) if ahead <= SIZE else 0
                self.before &= _MASK
            self.highest = number
        elif -SIZE <= ahead < 0:
            self.before |= 1 << -ahead - 1


class Window(Seen):
    """Counters of frames, and when the one with the highest was sent, by the sender's clock."""

    __slots__ = ("sent_at",)

    def __init__(self) -> None:
        super().__init__()
        self.sent_at = 0

    def judge(self, counter: int, sent_at: int) -> None:
        """Raise Refused unless a frame is new: later than all others, or overtaken on its way.

        A sender counts in the order in which it sends: a lower counter that was sent later, or a
        higher one that was sent earlier, comes from one that is not in order.
        """
        if counter > self.highest:
            if sent_at < self.sent_at and self.highest > 0:
                raise Refused(Reason.WENT_BACK, f"{counter}, sent before {self.highest}")
            return
        if sent_at > self.sent_at:
            raise Refused(Reason.WENT_BACK, f"{counter} after {self.highest}")
        if self.highest - counter > SIZE:
            is_recent = self.sent_at - sent_at < RECENT
            reason = Reason.WENT_BACK if is_recent else Reason.STALE
            raise Refused(reason, f"{counter} long after {self.highest}")
        if self.has(counter):
            raise Refused(Reason.REPLAYED)

    def accept(self, counter: int, sent_at: int) -> bool:
        """Note a frame that `judge` let pass; whether it is the newest so far."""
        is_newest = counter > self.highest
        self.note(counter)
        if is_newest:
            self.sent_at = sent_at
        return is_newest

    @property
    def shown(self) -> int:
        """The bits of `before` that a frame has room for."""
        return self.before & (1 << SHOWN) - 1


def was_accepted(counter: int, highest: int, shown: int) -> bool:
    """Return whether a frame of the other end says that it has accepted a counter."""
    return _is_among(counter, highest, shown, SHOWN)


def _is_among(number: int, highest: int, before: int, size: int) -> bool:
    behind = highest - number
    return behind == 0 or (0 < behind <= size and bool(before >> (behind - 1) & 1))
