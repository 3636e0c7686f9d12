"""Admission of datagrams to a bridge, and the signatures of its answers.

With a key, a datagram must be signed with it, be meant for this very bridge, be no older than
`MOST_AGE` by the bridge's clock, and have a higher counter than any its sender was admitted with.
A sender learns name and clock of the bridge by a first datagram to an unknown receiver: the answer
has both, and says which counter it answers. Only what is signed is ever answered.

The last counter of a sender is kept while a datagram of it could still be young enough; after that
a repetition is refused for its age. So the table cannot be filled by what was recorded.

Without a key everything is taken, and nothing is signed: for loopback only.
"""

from collections import Counter
from collections.abc import Callable
from typing import Final, NamedTuple

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.bridge.envelope import (
    LONGEST_HEAD,
    Envelope,
    Refused,
    new_name,
    opened,
    sealed,
)
from firmware_runtime.links.ports.datagrams import LONGEST, message_of

MOST_AGE: Final = 2 * SECOND
"""Ns after which what is on its way is no longer taken."""
MOST_AHEAD: Final = 100 * MILLISECOND
"""Ns by which a sender's idea of the bridge's clock may run ahead of it."""
MOST_SENDERS: Final = 256
"""How many senders' counters are kept at a time."""


class Admitted(NamedTuple):
    """A datagram that is taken: by whom it was signed, and what it says."""

    sender: str
    content: bytes


class NotAcquainted(Refused):
    """A signed datagram for a bridge that is not this one; `answer` makes its sender known."""

    def __init__(self, answer: bytes) -> None:
        self.answer = answer
        super().__init__("unacquainted")


class Unsigned:
    """Takes everything, and signs nothing."""

    longest = LONGEST
    """Bytes of the longest datagram that can be admitted."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        """Datagrams that were not admitted, by reason."""

    def admit(self, datagram: bytes) -> Admitted:
        """Take a datagram. Raises Refused, and counts it by its reason."""
        return Admitted("", datagram)

    def signed(self, receiver: str, content: bytes) -> bytes:  # noqa: ARG002 -- as of `Signed`
        """Return an answer to a sender."""
        return content


class Signed(Unsigned):
    """Takes what is signed with the key; `now` is any clock in ns that does not stand still."""

    longest = LONGEST + LONGEST_HEAD

    def __init__(self, key: bytes, now: Callable[[], int]) -> None:
        super().__init__()
        self.name = new_name()
        self._key = key
        self._now = now
        self._counter = 0
        self._last: dict[str, tuple[int, int]] = {}
        """Counter and instant of each sender's last datagram that was admitted."""

    def admit(self, datagram: bytes) -> Admitted:
        """Take a datagram. Raises Refused, and counts it by its reason."""
        try:
            return self._admit(datagram, self._now())
        except Refused as why:
            self.refused[why.reason] += 1
            raise

    def signed(self, receiver: str, content: bytes) -> bytes:
        """An answer to a sender, or to a receiver."""
        self._counter += 1
        envelope = Envelope(self.name, receiver, self._counter, self._now(), content)
        return sealed(self._key, "answer", envelope)

    def _admit(self, datagram: bytes, now: int) -> Admitted:
        if len(datagram) > self.longest:
            raise Refused("too long")
        sender, receiver, counter, at, content = opened(self._key, "ask", datagram)
        if receiver != self.name:
            raise NotAcquainted(self.signed(sender, message_of(answers=counter)))
        if now - at > MOST_AGE:
            raise Refused("stale")
        if at - now > MOST_AHEAD:
            raise Refused("ahead")
        if counter <= self._last.get(sender, (0, 0))[0]:
            raise Refused("replayed")
        if sender not in self._last:
            self._make_room(now)
        self._last[sender] = counter, now
        return Admitted(sender, content)

    def _make_room(self, now: int) -> None:
        if len(self._last) < MOST_SENDERS:
            return
        oldest = now - MOST_AGE - MOST_AHEAD
        self._last = {name: last for name, last in self._last.items() if last[1] >= oldest}
        if len(self._last) >= MOST_SENDERS:
            raise Refused("too many senders")
