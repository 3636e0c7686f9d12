"""Counters of one session that have been accepted: the highest, and those just below it."""

from typing import Final

from firmware_runtime.links.cut.refusal import Reason, Refused

SIZE: Final = 64
"""How many counters below the highest are remembered one by one."""
_MASK: Final = (1 << SIZE) - 1


class Window:
    """`highest` is 0 before the first; bit n of `before`: `highest` - 1 - n was accepted, too."""

    __slots__ = ("before", "highest", "sent_at")

    def __init__(self) -> None:
        self.highest = 0
        self.before = 0
        self.sent_at = 0
        """When the latest was sent, by the sender's clock."""

    def judge(self, counter: int, sent_at: int) -> None:
        """Raise Refused unless a frame is later than all that were accepted.

        One that was sent earlier was overtaken, or is sent again by an attacker; one that was sent
        later, and yet has a lower counter, comes from a sender that is not in order.
        """
        if counter > self.highest:
            return
        if sent_at > self.sent_at:
            raise Refused(Reason.WENT_BACK, f"{counter} after {self.highest}")
        raise Refused(Reason.REPLAYED if self.has(counter) else Reason.STALE)

    def note(self, counter: int, sent_at: int) -> None:
        """A frame that `judge` let pass is accepted."""
        if self.highest > 0:
            ahead = counter - self.highest
            self.before = (self.before << ahead | 1 << ahead - 1) & _MASK if ahead <= SIZE else 0
        self.highest, self.sent_at = counter, sent_at

    def has(self, counter: int) -> bool:
        """Whether it has been accepted, as far back as is remembered."""
        return was_accepted(counter, self.highest, self.before)


def was_accepted(counter: int, highest: int, before: int) -> bool:
    """Whether a counter is one of those that `highest` and the bits of `before` stand for."""
    behind = highest - counter
    return behind == 0 or (0 < behind <= SIZE and bool(before >> (behind - 1) & 1))
