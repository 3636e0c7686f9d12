"""Signed datagrams of the bridge: from whom, to whom, which in order, when, and the proof of it.

    fr1 ask SENDER RECEIVER COUNTER TIME MAC
    {"port": "yaw_reference", "value": 0.5}

What goes to the bridge is `ask`, what comes from it `answer`. SENDER and RECEIVER are 16
hexadecimal digits that a process draws when it begins; a receiver that is not known yet is all
zeros. COUNTER rises from each datagram of a sender to its next. TIME is the bridge's own clock in
ns, as far as the sender knows it. MAC is HMAC-SHA256 in hexadecimal digits, over the first line
without it and the space before it, the line's end, and the content.

    unknown --hello!--> unknown --answers?--> acquainted --ask!, answer?--> acquainted

A sender learns name and clock of the bridge by a first datagram to an unknown receiver: the answer
has both, and says which counter it answers. Only what is signed is ever answered. A bridge that was
started again, or whose clock stood still while its machine slept, is met by a new hello.

With a key, a datagram must be signed with it, be meant for this very bridge, be no older than
`MOST_AGE` by the bridge's clock, and have a higher counter than any its sender was admitted with.
The last counter of a sender is kept while a datagram of it could still be young enough; after that
a repetition is refused for its age. So the table cannot be filled by what was recorded. An answer
is believed if it is signed, meant for this sender, newer than the one before, and no older than
`MOST_AGE`: the clock of the bridge is known from its last answer, as of when that arrived.

Protocol without I/O: bytes in, bytes or a Refused out.
"""

import hmac
import re
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from secrets import token_hex
from typing import Final, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.ports.datagrams import LONGEST, message_of

UNKNOWN: Final = "0" * 16
"""The receiver that a sender names which has had no message from any yet."""
LONGEST_HEAD: Final = 160
"""Bytes that a signature adds to a content at most."""
Direction: TypeAlias = Literal["ask", "answer"]
T = TypeVar("T")

_LARGEST: Final = (1 << 63) - 1
_HEAD = re.compile(
    rb"(fr1 (ask|answer) ([0-9a-f]{16}) ([0-9a-f]{16}) (0|[1-9][0-9]{0,18}) (0|[1-9][0-9]{0,18}))"
    rb" ([0-9a-f]{64})\n"
)


class Refused(FirmwareRuntimeError):
    """A datagram is not let in; `reason` is one word to count it by."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)


class Envelope(NamedTuple):
    """One datagram, with what its signature covers."""

    sender: str
    receiver: str
    counter: int
    at: int
    """Ns of the bridge's clock."""
    content: bytes


def new_name() -> str:
    """A name for a process that no other has; never UNKNOWN, but for one in 2 to the 64."""
    return token_hex(8)


def sealed(key: bytes, direction: Direction, envelope: Envelope) -> bytes:
    """The datagram that an envelope goes in."""
    sender, receiver, counter, at, content = envelope
    head = f"fr1 {direction} {sender} {receiver} {counter} {at}".encode()
    return head + b" " + _mac(key, head, content) + b"\n" + content


def opened(key: bytes, direction: Direction, datagram: bytes) -> Envelope:
    """Return what is in a datagram. Raises Refused: `malformed`, `forged` or `reflected`."""
    found = _HEAD.match(datagram)
    if found is None:
        raise Refused("malformed")
    head, way, sender, receiver, counter, at, mac = found.groups()
    content = datagram[found.end() :]
    if not hmac.compare_digest(mac, _mac(key, head, content)):
        raise Refused("forged")
    if way != direction.encode():
        raise Refused("reflected")
    envelope = Envelope(sender.decode(), receiver.decode(), int(counter), int(at), content)
    if max(envelope.counter, envelope.at) > _LARGEST:
        raise Refused("malformed")
    return envelope


def _mac(key: bytes, head: bytes, content: bytes) -> bytes:
    return hmac.digest(key, head + b"\n" + content, "sha256").hex().encode()


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


class Signer:
    """One process that signs: its name, its counter, and what it has refused."""

    def __init__(self, key: bytes) -> None:
        self.name = new_name()
        self.refused: Counter[str] = Counter()
        """Datagrams that were not taken, by reason."""
        self._key = key
        self._counter = 0

    def _sealed(self, way: Direction, receiver: str, at: int, content: bytes) -> bytes:
        self._counter += 1
        return sealed(self._key, way, Envelope(self.name, receiver, self._counter, at, content))

    def _taken(self, judge: Callable[[bytes, int], T], datagram: bytes, now: int) -> T:
        """Return what comes of a datagram. Raises Refused, and counts it by its reason."""
        try:
            return judge(datagram, now)
        except Refused as why:
            self.refused[why.reason] += 1
            raise


class Signed(Signer):
    """Bridge's side: takes what is signed; `now` is any clock in ns that does not stand still."""

    longest = LONGEST + LONGEST_HEAD
    """Bytes of the longest datagram that can be admitted."""

    def __init__(self, key: bytes, now: Callable[[], int]) -> None:
        super().__init__(key)
        self._now = now
        self._last: dict[str, tuple[int, int]] = {}
        """Counter and instant of each sender's last datagram that was admitted."""

    def admit(self, datagram: bytes) -> Admitted:
        """Take a datagram. Raises Refused, and counts it by its reason."""
        return self._taken(self._admitted, datagram, self._now())

    def signed(self, receiver: str, content: bytes) -> bytes:
        """An answer to a sender, or to a receiver."""
        return self._sealed("answer", receiver, self._now(), content)

    def _admitted(self, datagram: bytes, now: int) -> Admitted:
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


class Unsigned:
    """Bridge's side without a key: takes everything, and signs nothing; for loopback only."""

    longest = LONGEST

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()

    def admit(self, datagram: bytes) -> Admitted:
        """Take a datagram."""
        return Admitted("", datagram)

    def signed(self, receiver: str, content: bytes) -> bytes:  # noqa: ARG002 -- as of `Signed`
        """Return an answer to a sender."""
        return content


class Hello(msgspec.Struct):
    """The answer to a sender that the bridge is not acquainted with; else `answers` is 0."""

    answers: int = 0


_hello = msgspec.json.Decoder(Hello).decode


class Acquaintance(Signer):
    """Sender's side: one sender, and the bridge that it speaks with."""

    def __init__(self, key: bytes) -> None:
        super().__init__(key)
        self._bridge = UNKNOWN
        self._bridge_ahead = 0
        """Ns by which the bridge's clock is ahead of this one."""
        self._answered = 0
        """The highest counter of the bridge's answers."""

    @property
    def is_made(self) -> bool:
        """Return whether there is a bridge to ask."""
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
        at = max(0, min(now + self._bridge_ahead, _LARGEST)) if self.is_made else 0
        return self._sealed("ask", self._bridge, at, content)

    def believe(self, datagram: bytes, now: int) -> bytes | None:
        """The content of an answer; None if it only makes the bridge known.

        Raises Refused, and counts it by its reason.
        """
        return self._taken(self._believed, datagram, now)

    def _believed(self, datagram: bytes, now: int) -> bytes | None:
        answer = opened(self._key, "answer", datagram)
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
    with suppress(msgspec.MsgspecError):
        return _hello(content).answers
    return 0
