"""Attacks on a bridge with a key: signed envelopes, and what they say to the ports of a run.

The reference is written from docs/bridge.md: it splits where the product matches, and has its own
idea of every rule.
"""

import hashlib
import hmac
from collections import Counter
from collections.abc import Callable, Iterator
from enum import Enum
from random import Random
from typing import Any, Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.links.bridge.signatures import Refused, Signed
from firmware_runtime.links.ports.datagrams import Put, Refusal, understood
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.models.motion import Motion
from tests.support.hostile.frames import KEY, OTHER_KEY
from tests.support.hostile.sweep import ACCEPTED, Attempt

_STRANGER = "0" * 16
_HEX = frozenset(b"0123456789abcdef")
_DIGITS = frozenset(b"0123456789")


class Mode(Enum):
    """A port's type with names."""

    OFF = 0
    HOVER = 1


GOOD: Final[dict[bytes, tuple[str, object]]] = {
    b'{"port": "yaw", "value": 0.5}': ("yaw", 0.5),
    b'{"port": "yaw", "value": -3}': ("yaw", -3.0),
    b'{"port": "motion", "value": {"position": 0.25, "rate": -1.0}}': ("motion", (0.25, -1.0)),
    b'{"port": "mode", "value": "HOVER"}': ("mode", Mode.HOVER),
    b'{"port": "enable", "value": true}': ("enable", True),
}
"""What may be said, and what then enters the model."""
BAD: Final = (
    b'{"port": "yaw", "value": NaN}',
    b'{"port": "yaw", "value": Infinity}',
    b'{"port": "yaw", "value": -Infinity}',
    b'{"port": "yaw", "value": 1e999}',
    b'{"port": "yaw", "value": "0.5"}',
    b'{"port": "yaw", "value": null}',
    b'{"port": "yaw", "value": true}',
    b'{"port": "yaw", "value": [0.5]}',
    b'{"port": "yaw"}',
    b'{"port": "nothing", "value": 0.5}',
    b'{"port": "", "value": 0.5}',
    b'{"port": 1, "value": 0.5}',
    b'{"port": "yaw", "value": 0.5, "arm": true}',
    b'{"port": "motion", "value": {"position": 0.25}}',
    b'{"port": "motion", "value": {"position": 0.25, "rate": 0, "jerk": 0}}',
    b'{"port": "motion", "value": {"position": 0.25, "rate": NaN}}',
    b'{"port": "mode", "value": "ARM"}',
    b'{"port": "enable", "value": 1}',
    b'{"port": "yaw", "value": 0.5',
    b'{"port": "y\xff", "value": 0.5}',
    b"[" * 4000,
    b'{"port": "yaw", "value": ' + b"9" * 4000 + b"}",
    b"arm",
    b"{}",
    b"",
    b"null",
)
"""What no port takes, though it is signed."""
CONTENT: Final = "content"


class BridgeTarget:
    """A bridge's admission and the ports of a model; time goes on as datagrams come."""

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)  # noqa: S311 -- to be repeated, not to be secret
        self._now = 10_000_000_000
        self._signed = Signed(KEY, lambda: self._now)
        model = Coupled("robot")
        for port, kind in {"yaw": float, "motion": Motion, "mode": Mode, "enable": bool}.items():
            model.in_port(port, kind)
        self._ports = Ports(model)
        self._content_refused = 0
        self._found: Counter[object] = Counter()
        self._expected: Counter[object] = Counter()
        self._last: dict[str, int] = {}
        self._senders = [self._name() for _ in range(40)]
        self._counters = dict.fromkeys(self._senders, 0)
        self._sent: list[bytes] = []

    # What comes -----------------------------------------------------------------------------------

    def attempts(self, count: int) -> Iterator[Attempt]:
        """So many; one in four is honest."""
        ways = self._ways()
        for _ in range(count):
            self._now += self._random.choice((0, 1_000, 50_000, 2_000_000))
            what, make = ways[self._random.randrange(len(ways))]
            datagram = make()
            if what == "honest" and self._random.random() < 0.2:
                self._sent = [*self._sent[-2000:], datagram]
            yield Attempt(what, datagram, self._now)

    def _ways(self) -> list[tuple[str, Callable[[], bytes]]]:
        random, honest = self._random, self._honest
        ways: list[tuple[str, Callable[[], bytes]]] = [
            ("bad content", lambda: honest(content=random.choice(BAD))),
            ("another key", lambda: honest(key=OTHER_KEY)),
            ("no key", lambda: random.choice(list(GOOD))),
            ("bit flipped", lambda: self._flipped(honest())),
            ("cut short", lambda: (d := honest())[: random.randrange(len(d))]),
            ("made longer", lambda: honest() + random.randbytes(random.randrange(1, 40))),
            ("oversized", lambda: honest() + bytes(random.randrange(16_300, 20_000))),
            ("oversized, signed", lambda: honest(content=b" " * random.randrange(16_400, 18_000))),
            ("said before", self._replayed),
            ("stale", lambda: honest(at=self._now - random.randrange(2_000_000_001, 10**10))),
            ("ahead", lambda: honest(at=self._now + random.randrange(100_000_001, 10**15))),
            ("out of order", lambda: honest(counter=random.randrange(0, 50))),
            ("for another", lambda: honest(receiver=self._name())),
            ("for none", lambda: honest(receiver=_STRANGER)),
            ("an answer", lambda: honest(direction="answer")),
            ("sent back", lambda: self._signed.signed(random.choice(self._senders), b"{}")),
            ("numbers too large", lambda: honest(counter=random.choice((1 << 63, 10**19, 10**30)))),
            ("noise", lambda: random.randbytes(random.randrange(0, 300))),
            ("noise with a head", lambda: b"fr1 ask " + random.randbytes(200)),
            ("written otherwise", self._otherwise),
        ]
        return [*ways, *[("honest", honest)] * (len(ways) // 3)]

    def _honest(
        self,
        *,
        content: bytes | None = None,
        key: bytes = KEY,
        counter: int | None = None,
        at: int | None = None,
        receiver: str | None = None,
        direction: str = "ask",
    ) -> bytes:
        sender = self._random.choice(self._senders)
        if counter is None:
            self._counters[sender] += self._random.choice((1, 1, 1, 7))
            counter = self._counters[sender]
        at = self._now - self._random.randrange(0, 2_000_000) if at is None else max(at, 0)
        content = self._random.choice(list(GOOD)) if content is None else content
        receiver = self._signed.name if receiver is None else receiver
        head = f"fr1 {direction} {sender} {receiver} {counter} {at}".encode()
        return head + b" " + _mac(key, head, content) + b"\n" + content

    def _replayed(self) -> bytes:
        return self._random.choice(self._sent) if self._sent else b""

    def _flipped(self, datagram: bytes) -> bytes:
        flipped = bytearray(datagram)
        bit = self._random.randrange(8 * len(flipped))
        flipped[bit // 8] ^= 1 << bit % 8
        return bytes(flipped)

    def _otherwise(self) -> bytes:
        was, written = self._random.choice(
            ((b" ", b"  "), (b"\n", b"\r\n"), (b"fr1 ", b"fr2 "), (b"fr1 ", b" fr1 "), (b"\n", b""))
        )
        return self._honest().replace(was, written, 1)

    def _name(self) -> str:
        return f"{self._random.getrandbits(64):016x}"

    # Two verdicts ---------------------------------------------------------------------------------

    def judge(self, attempt: Attempt) -> str:
        """The product's."""
        try:
            content = self._signed.admit(attempt.datagram).content
        except Refused as why:
            return why.reason
        try:
            request = understood(content)
            if not isinstance(request, Put):
                raise Refusal("nothing else was said")  # noqa: TRY301 -- as the run counts it
            port, value = self._ports.arrival(request.port, request.value)
        except Refusal:
            self._content_refused += 1
            return CONTENT
        self._found[port.name, value] += 1
        return ACCEPTED

    def expected(self, attempt: Attempt) -> str:  # noqa: PLR0911 -- a rule, a return
        """The reference's, in the order of the document's table."""
        datagram, now = attempt.datagram, attempt.at
        if len(datagram) > 16_384 + 160:
            return "too long"
        line, end, content = datagram.partition(b"\n")
        words = line.split(b" ")
        if not end or not _is_head(words):
            return "malformed"
        if _mac(KEY, b" ".join(words[:-1]), content) != words[-1]:
            return "forged"
        sender, receiver = words[2].decode(), words[3].decode()
        counter, at = int(words[4]), int(words[5])
        if words[1] == b"answer":
            return "reflected"
        if counter >= 1 << 63 or at >= 1 << 63:
            return "malformed"
        if receiver != self._signed.name:
            return "unacquainted"
        if not now - 2_000_000_000 <= at <= now + 100_000_000:
            return "stale" if at < now else "ahead"
        if counter <= self._last.get(sender, 0):
            return "replayed"
        self._last[sender] = counter
        if content not in GOOD:
            return CONTENT
        self._expected[GOOD[content]] += 1
        return ACCEPTED

    def taken(self) -> tuple[object, object]:
        """What entered, and what should have."""
        return self._found, self._expected

    def counted(self) -> dict[str, int]:
        """By reason."""
        return {**self._signed.refused, CONTENT: self._content_refused}


def _is_head(words: list[bytes]) -> bool:
    if len(words) != 7 or words[0] != b"fr1" or words[1] not in {b"ask", b"answer"}:
        return False
    names_fit = all(len(word) == 16 and _HEX.issuperset(word) for word in words[2:4])
    numbers_fit = all(_is_number(word) for word in words[4:6])
    return names_fit and numbers_fit and len(words[6]) == 64 and _HEX.issuperset(words[6])


def _is_number(word: bytes) -> bool:
    return 0 < len(word) <= 19 and _DIGITS.issuperset(word) and (word == b"0" or word[0] != 48)


def _mac(key: bytes, head: bytes, content: bytes) -> bytes:
    made: Any = hmac.new(key, digestmod=hashlib.sha256)
    for part in (head, b"\n", content):
        made.update(part)
    return made.hexdigest().encode()  # type: ignore[no-any-return]
