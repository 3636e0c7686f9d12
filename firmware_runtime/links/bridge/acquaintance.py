"""The other side of `admission`: how a sender gets to know a bridge, and which answers it believes.

    unknown --hello!--> unknown --answers?--> acquainted --ask!, answer?--> acquainted

The clock of the bridge is known from its last answer, as of when that arrived: what is sent carries
it, so a datagram that was held back for long is recognised by its age. An answer is believed if it
is signed, meant for this sender, newer than the one before, and no older than `MOST_AGE`. A bridge
that was started again, or whose clock stood still while its machine slept, is met by a new hello.

Protocol without I/O.
"""

from collections import Counter
from typing import Final

import msgspec

from firmware_runtime.links.bridge.admission import MOST_AGE
from firmware_runtime.links.bridge.envelope import (
    UNKNOWN,
    Envelope,
    Refused,
    new_name,
    opened,
    sealed,
)

_LARGEST: Final = (1 << 63) - 1


class Hello(msgspec.Struct):
    """The answer to a sender that the bridge is not acquainted with; else `answers` is 0."""

    answers: int = 0


_hello = msgspec.json.Decoder(Hello).decode


class Acquaintance:
    """One sender, and the bridge that it speaks with."""

    def __init__(self, key: bytes) -> None:
        self.name = new_name()
        self.refused: Counter[str] = Counter()
        """How many answers were not believed, by reason."""
        self._key = key
        self._counter = 0
        self._bridge = UNKNOWN
        self._bridge_ahead = 0
        """Ns by which the bridge's clock is ahead of this one."""
        self._answered = 0
        """The highest counter of the bridge's answers."""

    @property
    def is_made(self) -> bool:
        """Whether there is a bridge to ask."""
        return self._bridge != UNKNOWN

    def hello(self, now: int) -> bytes:
        """The datagram whose answer makes the bridge known; until then there is none."""
        self.end()
        return self.ask(b"", now)

    def end(self) -> None:
        """Forget the bridge."""
        self._bridge = UNKNOWN

    def ask(self, content: bytes, now: int) -> bytes:
        """The datagram with a content."""
        self._counter += 1
        at = max(0, min(now + self._bridge_ahead, _LARGEST)) if self.is_made else 0
        envelope = Envelope(self.name, self._bridge, self._counter, at, content)
        return sealed(self._key, "ask", envelope)

    def believe(self, datagram: bytes, now: int) -> bytes | None:
        """The content of an answer; None if it only makes the bridge known.

        Raises Refused, and counts it by its reason.
        """
        try:
            return self._believed(opened(self._key, "answer", datagram), now)
        except Refused as why:
            self.refused[why.reason] += 1
            raise

    def _believed(self, answer: Envelope, now: int) -> bytes | None:
        if answer.receiver != self.name:
            raise Refused("for another")
        answers = _answered_counter(answer.content)
        if answers == 0:
            self._check_answer(answer, now)
        elif answers != self._counter:
            raise Refused("late")
        self._bridge, self._answered = answer.sender, answer.counter
        self._bridge_ahead = answer.at - now
        return answer.content if answers == 0 else None

    def _check_answer(self, answer: Envelope, now: int) -> None:
        if answer.sender != self._bridge:
            raise Refused("another bridge")
        if answer.counter <= self._answered:
            raise Refused("replayed")
        if now + self._bridge_ahead - answer.at > MOST_AGE:
            raise Refused("stale")


def _answered_counter(content: bytes) -> int:
    try:
        return _hello(content).answers
    except msgspec.MsgspecError:
        return 0
