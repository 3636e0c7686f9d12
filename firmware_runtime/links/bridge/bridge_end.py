"""The other end of a bridge: how a process on any machine speaks with a running robot.

    unknown --hello!--> unknown --answers?--> acquainted --ask!, answer?--> acquainted

The clock of the bridge is known from its last answer, as of when that arrived: what is sent carries
it, so a datagram that was held back for long is recognised by its age. An answer is believed if it
is signed, meant for this sender, newer than the one before, and no older than `MOST_AGE`. A bridge
that was started again, or whose clock stood still while its machine slept, is met by a new hello.
"""

import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from select import select
from time import monotonic_ns
from typing import Final

import msgspec

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.bridge.admission import MOST_AGE
from firmware_runtime.links.bridge.envelope import (
    UNKNOWN,
    Envelope,
    Refused,
    new_name,
    opened,
    sealed,
)
from firmware_runtime.links.endpoint import Endpoint
from firmware_runtime.links.ports.robot_end import AT_ONCE, NoAnswer

TIMEOUT: Final = 2 * SECOND
"""Ns that a bridge has to answer a hello."""
HELLO_EVERY: Final = 250 * MILLISECOND
_LONGEST: Final = 1 << 16


_LARGEST: Final = (1 << 63) - 1


class Hello(msgspec.Struct):
    """The answer to a sender that the bridge is not acquainted with; else `answers` is 0."""

    answers: int = 0


_hello = msgspec.json.Decoder(Hello).decode


class Acquaintance:
    """One sender, and the bridge that it speaks with; protocol without I/O."""

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


class BridgeEnd:
    """A UDP socket that speaks with one bridge; with a key all is signed, and answers verified.

    Without one, the bridge is one on loopback that has none. Raises OSError if there is no way.
    """

    def __init__(self, bridge: Endpoint, key: bytes | None) -> None:
        self._bridge = bridge
        self._acquaintance = None if key is None else Acquaintance(key)
        self._last = b""
        self.why_not_believed = ""
        """As of `RobotEnd`: what is not believed is left out here."""
        self._socket = socket.socket(bridge.family, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        try:
            self._socket.connect(bridge.where)
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """The descriptor that becomes readable when the bridge has said something."""
        return self._socket.fileno()

    def send(self, content: bytes) -> None:
        """Say something; first become acquainted, which is waited for.

        Raises NoAnswer if the bridge does not know the key, another OSError if there is none.
        """
        self._last = content
        if self._acquaintance is None:
            self._socket.send(content)
            return
        if not self._acquaintance.is_made:
            self._meet(self._acquaintance)
        self._socket.send(self._acquaintance.ask(content, monotonic_ns()))

    def received(self) -> Iterator[bytes]:
        """Return what the robot has said, without waiting; what is not believed is left out.

        A bridge that has taken the place of another gets what the other did not take.
        """
        for datagram in self._datagrams():
            if self._acquaintance is None:
                yield datagram
                continue
            with suppress(Refused):
                content = self._acquaintance.believe(datagram, monotonic_ns())
                if content is None:
                    self.send(self._last)
                else:
                    yield content

    def forget(self) -> None:
        """Meet the bridge again before the next is sent: it has not answered."""
        if self._acquaintance is not None:
            self._acquaintance.end()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _meet(self, acquaintance: Acquaintance) -> None:
        until = monotonic_ns() + TIMEOUT
        while (now := monotonic_ns()) < until:
            self._socket.send(acquaintance.hello(now))
            select([self], (), (), min(HELLO_EVERY, until - now) / SECOND)
            for datagram in self._datagrams():
                with suppress(Refused):
                    acquaintance.believe(datagram, monotonic_ns())
            if acquaintance.is_made:
                return
        expected = "expected a bridge with the same key"
        raise NoAnswer(f"no answer within {TIMEOUT // SECOND} s; {expected}", where=self._bridge)

    def _datagrams(self) -> Iterator[bytes]:
        with suppress(BlockingIOError):
            for _ in range(AT_ONCE):
                yield self._socket.recv(_LONGEST)
