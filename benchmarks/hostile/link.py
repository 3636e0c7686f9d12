"""Attacks on the robot's end of a link with a key.

The honest peer sends values, heartbeats and greetings, and is started again now and then. All is
done to its frames that can be done on a network, and more is sent by one who has the key and means
ill.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from random import Random

from benchmarks.hostile.frames import (
    BAD_BYES,
    BAD_MOTIONS,
    BAD_YAWS,
    BYE,
    HEARTBEAT,
    HELLO,
    KEY,
    MOTIONS,
    OTHER_KEY,
    REPORT,
    VALUE,
    YAWS,
    Fields,
    array,
    frame,
    hello,
    tag,
)
from benchmarks.hostile.link_rules import MS, LinkRules
from benchmarks.hostile.robot_end import TIMEOUT, RobotEnd
from benchmarks.hostile.sweep import ACCEPTED, NO_VALUE, Attempt


class LinkTarget:
    """The robot's end, and a peer in front of it."""

    name = "link over UDP with a key"

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)  # noqa: S311 -- to be repeated, not to be secret
        self._stack = ExitStack()
        self._end = RobotEnd(self._stack)
        link = self._end.link
        fits = hello(link.cut.digest, array(b"\x00", b"\x01"))
        self._hellos = {
            fits: "",
            hello(bytes(32), array(b"\x00", b"\x01")): "other_cut",
            hello(link.cut.digest, array(b"\x02")): "other_cut",
            fits[:-1]: "malformed",
            fits + b"\x00": "malformed",
            b"": "malformed",
            b"\xc0": "malformed",
        }
        self._fits = fits
        self._rules = LinkRules(link.peer.session, self._hellos, TIMEOUT)
        self._found: list[tuple[str, object]] = []
        self._refused: Counter[str] = Counter()
        self._recorded: list[bytes] = []
        self._sequences = [0, 0]
        self._begin_session()

    # What comes -----------------------------------------------------------------------------------

    def attempts(self, count: int) -> Iterator[Attempt]:
        """So many; the honest peer greets first, and is started again every few thousand."""
        ways = self._ways()
        with self._stack:
            waiting: list[tuple[str, bytes]] = []
            for number in range(count):
                if number % 4000 == 0:
                    waiting = self._started_again()
                if waiting:
                    what, datagram = waiting.pop(0)
                else:
                    self._end.now += self._random.choice((1_000, 20_000, 300_000, 2 * MS))
                    what, make = ways[self._random.randrange(len(ways))]
                    datagram = make()
                yield Attempt(what, datagram, self._end.now)

    def _started_again(self) -> list[tuple[str, bytes]]:
        """A silence, and the first frames of a new session; recorded ones are tried before them."""
        self._end.now += 3 * TIMEOUT
        self._begin_session()
        greeting = self._honest(HELLO, peer=0, body=self._fits)
        answer = self._honest(HELLO, body=self._fits)
        return [("greeting", greeting), ("greeting", answer), ("honest", self._value())]

    def _begin_session(self) -> None:
        self._session = self._random.getrandbits(64) or 1
        self._counter = 0
        self._sequences = [0, 0]
        self._ahead = self._random.choice((0, 10**12, -(10**11), 123_456_789_123))
        self._rules.clock_ahead = self._ahead

    def _ways(self) -> list[tuple[str, Callable[[], bytes]]]:
        random, honest, value = self._random, self._honest, self._value
        ways: list[tuple[str, Callable[[], bytes]]] = [
            ("another key", lambda: value(key=OTHER_KEY)),
            ("no key", lambda: value(key=None)),
            ("bit flipped", lambda: self._flipped(value())),
            ("cut short", lambda: (d := value())[: random.randrange(len(d))]),
            ("made longer", lambda: value() + random.randbytes(random.randrange(1, 40))),
            ("oversized", lambda: value() + bytes(random.randrange(8192, 9000))),
            ("oversized, signed", lambda: honest(VALUE, body=bytes(random.randrange(8073, 9000)))),
            ("noise", lambda: random.randbytes(random.randrange(300))),
            ("noise, signed", self._noise),
            ("said before", self._again),
            ("overtaken", self._overtaken),
            ("went back", lambda: value(counter=max(1, self._counter - random.randrange(1, 200)))),
            ("stale frame", lambda: value(late=random.randrange(TIMEOUT + 50 * MS, 10**13))),
            ("stale value", lambda: value(old=random.randrange(TIMEOUT + 50 * MS, 10**13))),
            ("value again", lambda: value(sequence_back=random.randrange(1, 5))),
            ("wrong port", lambda: value(port=random.choice((2, 3, 77, 65535)))),
            ("not what the port carries", self._bad_value),
            ("for another session", lambda: value(peer=self._word())),
            ("for none", lambda: value(peer=0)),
            ("from nowhere", lambda: value(session=self._word())),
            ("from the robot itself", lambda: value(session=self._rules.session)),
            ("a greeting", lambda: honest(HELLO, peer=0, body=random.choice(list(self._hellos)))),
            ("another's greeting", self._another_s_greeting),
            ("a report", lambda: honest(REPORT, body=b"\x80")),
            ("kind", lambda: honest(random.choice((0, 6, 255)))),
            ("flags", lambda: honest(VALUE, flags=random.choice((1, 128)))),
            ("no counter", lambda: value(counter=0)),
            ("a bad bye", lambda: honest(BYE, body=random.choice(BAD_BYES))),
            ("heartbeat", lambda: honest(HEARTBEAT)),
        ]
        return [*ways, *[("honest", value)] * (len(ways) // 2)]

    def _honest(  # noqa: PLR0913 -- each is one thing that an attack changes
        self,
        kind: int,
        *,
        key: bytes | None = KEY,
        counter: int | None = None,
        late: int = 0,
        session: int | None = None,
        peer: int | None = None,
        body: bytes = b"",
        port: int = 0,
        old: int = 0,
        sequence: int = 0,
        flags: int = 0,
    ) -> bytes:
        """A frame of the peer, about a millisecond on its way; `late` ns more, if that is said."""
        if counter is None:
            self._counter += self._random.choice((1, 1, 1, 1, 3, 100))
            counter = self._counter
        now, way = self._end.now, self._random.randrange(200_000, MS)
        sent_at = now - way - late + self._ahead
        held = self._random.randrange(0, 20 * MS)
        fields = Fields(
            kind,
            self._session if session is None else session,
            self._rules.session if peer is None else peer,
            counter,
            sent_at,
            now - way - late - held - self._random.randrange(200_000, MS),
            held,
            port,
            sent_at - old - self._random.randrange(2 * MS),
            sequence,
            body,
            flags,
        )
        made = frame(fields, key)
        if key is KEY and self._random.random() < 0.02:
            self._recorded = [*self._recorded[-500:], made]
        return made

    def _value(  # noqa: PLR0913 -- likewise
        self,
        *,
        port: int | None = None,
        body: bytes | None = None,
        sequence_back: int = 0,
        key: bytes | None = KEY,
        counter: int | None = None,
        late: int = 0,
        old: int = 0,
        session: int | None = None,
        peer: int | None = None,
    ) -> bytes:
        number = self._random.randrange(2) if port is None else port
        if number < 2:
            self._sequences[number] += 1
        sequence = self._sequences[number] if number < 2 else 1
        if body is None:
            body = self._random.choice(list((MOTIONS, YAWS)[number % 2]))
        return self._honest(
            VALUE,
            key=key,
            counter=counter,
            late=late,
            session=session,
            peer=peer,
            body=body,
            port=number,
            old=old,
            sequence=max(1, sequence - sequence_back),
        )

    def _bad_value(self) -> bytes:
        port = self._random.randrange(2)
        return self._value(port=port, body=self._random.choice(list((BAD_MOTIONS, BAD_YAWS)[port])))

    def _noise(self) -> bytes:
        plain = self._random.randbytes(self._random.randrange(300))
        return plain + tag(plain)

    def _again(self) -> bytes:
        return self._random.choice(self._recorded) if self._recorded else b""

    def _overtaken(self) -> bytes:
        """A frame that was sent long before, and had been lost until now."""
        counter = max(1, self._counter - self._random.randrange(1, 200))
        return self._value(counter=counter, late=self._random.randrange(60_000 * MS, 10**13))

    def _another_s_greeting(self) -> bytes:
        return self._honest(HELLO, peer=0, session=self._word(), body=self._fits)

    def _flipped(self, datagram: bytes) -> bytes:
        flipped = bytearray(datagram)
        bit = self._random.randrange(8 * len(flipped))
        flipped[bit // 8] ^= 1 << bit % 8
        return bytes(flipped)

    def _word(self) -> int:
        return self._random.getrandbits(64) or 1

    # Two verdicts ---------------------------------------------------------------------------------

    def judge(self, attempt: Attempt) -> str:
        """The product's."""
        values = self._end.take(attempt.datagram)
        self._found += values
        before, self._refused = self._refused, self._end.refused()
        new = self._refused - before
        if new.total() > 1 or (new and values):
            return f"{dict(new)} and {values}"
        return next(iter(new), ACCEPTED if values else NO_VALUE)

    def expected(self, attempt: Attempt) -> str:
        """The reference's."""
        return self._rules.verdict(attempt.datagram, attempt.at)

    def taken(self) -> tuple[object, object]:
        """What entered, and what should have."""
        names = ("controller:motion", "controller:yaw")
        return self._found, [(names[port], value) for port, value in self._rules.values]

    def counted(self) -> dict[str, int]:
        """By reason."""
        return dict(self._end.refused())
