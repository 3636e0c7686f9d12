"""Attacks on the robot's end of a link with a key.

The honest peer sends values, heartbeats and greetings, and is started again now and then. All is
done to its frames that can be done on a network, and more is sent by one who has the key and means
ill.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from random import Random

from tests.support.hostile.frames import (
    BAD_BYES,
    BAD_MOTIONS,
    BAD_YAWS,
    BYE,
    GOOD_BYE,
    HEADER,
    HEARTBEAT,
    HELLO,
    MOTIONS,
    OTHER_KEY,
    REPORT,
    STEP,
    YAWS,
    Entry,
    array,
    hello,
    step,
    tag,
)
from tests.support.hostile.link_rules import MS, LinkRules
from tests.support.hostile.peer_frames import PeerFrames
from tests.support.hostile.robot_end import TIMEOUT, RobotEnd
from tests.support.hostile.sweep import ACCEPTED, NO_VALUE, Attempt

OWN_PORTS = [0, 1, 2]
"""The numbers of what the peer sends: motion, turn and yaw."""
OLD = (TIMEOUT + 50 * MS, 10**13)
"""How much older what is too old can be, ns."""


class LinkTarget:
    """The robot's end, and a peer in front of it."""

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)  # noqa: S311 -- to be repeated, not to be secret
        self._stack = ExitStack()
        self._end = RobotEnd(self._stack)
        link = self._end.link
        fits = hello(link.cut.digest, OWN_PORTS)
        self._hellos = {
            fits: "",
            hello(bytes(32), OWN_PORTS): "other_cut",
            hello(link.cut.digest, [3]): "other_cut",
            fits[:-1]: "malformed",
            fits + b"\x00": "malformed",
            b"": "malformed",
            b"\xc0": "malformed",
        }
        self._fits = fits
        self._rules = LinkRules(link.peer.session, self._hellos, TIMEOUT)
        self._found: list[tuple[str, object]] = []
        self._refused: Counter[str] = Counter()
        self._lacks: list[bool] = []
        """For each attempt whether the robot lacked something for too long after it."""
        self._should_lack: list[bool] = []
        self._peer = PeerFrames(self._random, lambda: self._end.now, self._rules.session)
        self._note_session()

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
        self._peer.begin_session()
        self._note_session()
        greeting = self._peer.honest(HELLO, peer=0, body=self._fits)
        answer = self._peer.honest(HELLO, body=self._fits)
        return [("greeting", greeting), ("greeting", answer), ("honest", self._peer.value())]

    def _note_session(self) -> None:
        self._held_back: list[bytes] = []
        self._rules.ahead[self._peer.session] = self._peer.ahead

    def _ways(self) -> list[tuple[str, Callable[[], bytes]]]:
        random, peer = self._random, self._peer
        honest, value, turn = peer.honest, peer.value, peer.turn
        ways: list[tuple[str, Callable[[], bytes]]] = [
            ("another key", lambda: value(key=OTHER_KEY)),
            ("no key", lambda: value(key=None)),
            ("bit flipped", lambda: self._flipped(value())),
            ("cut short", lambda: (d := value())[: random.randrange(len(d))]),
            ("made longer", lambda: value() + random.randbytes(random.randrange(1, 40))),
            ("oversized", lambda: value() + bytes(random.randrange(61_440, 62_000))),
            ("oversized, signed", lambda: honest(STEP, body=bytes(61_440 - HEADER))),
            ("noise", lambda: random.randbytes(random.randrange(300))),
            ("noise, signed", self._noise),
            ("said before", self._again),
            ("held back", self._held),
            ("overtaken", self._overtaken),
            ("overtaken for long", lambda: self._overtaken(random.randrange(900, 1200))),
            ("overtaken and old", lambda: self._overtaken(late=random.randrange(*OLD))),
            ("recorded long before", lambda: self._overtaken(2000, late=random.randrange(*OLD))),
            (
                "went back",
                lambda: value(counter=max(1, self._peer.counter - random.randrange(1, 2000))),
            ),
            ("sent before the one before", lambda: value(late=random.randrange(*OLD))),
            ("old values", lambda: value(old=random.randrange(*OLD))),
            ("values again", lambda: value(sequence_back=random.randrange(1, 2000))),
            ("wrong port", self._wrong_port),
            ("not what the port carries", self._bad_value),
            ("no step", self._no_step),
            ("a turn that comes after none", lambda: turn(gap=random.randrange(1, 4))),
            ("a turn that comes after another", turn),
            ("a turn that waits for none that comes", lambda: turn(skip=1)),
            ("for another session", lambda: value(peer=self._word())),
            ("for none", lambda: value(peer=0)),
            ("from nowhere", lambda: value(session=self._word())),
            ("from the robot itself", lambda: value(session=self._rules.session)),
            ("a greeting", lambda: honest(HELLO, peer=0, body=random.choice(list(self._hellos)))),
            ("another's greeting", self._another_s_greeting),
            ("a report", lambda: honest(REPORT, body=b"\x80")),
            ("kind", lambda: honest(random.choice((0, 6, 255)))),
            ("flags", lambda: honest(STEP, flags=random.choice((1, 128)))),
            ("no counter", lambda: value(counter=0)),
            ("a bye", lambda: honest(BYE, body=GOOD_BYE)),
            ("a bad bye", lambda: honest(BYE, body=random.choice(BAD_BYES))),
            ("heartbeat", lambda: honest(HEARTBEAT)),
            ("what is missing", lambda: honest(HEARTBEAT, missing=self._missing())),
            ("what is missing, in a step", lambda: value(missing=self._missing())),
        ]
        return [*ways, *[("honest", value)] * (len(ways) // 2)]

    def _missing(self) -> tuple[int, int, int]:
        """For how long something is missing, its sequence and its port; most of it is there."""
        port = self._random.choice((0, 1, 2, 2, 3, 65535))
        sequences = self._peer.sequences
        newest = sequences[port] if port < len(sequences) else 1
        ago = self._random.choice((0, TIMEOUT // 8, *OLD))
        return ago, max(0, newest + self._random.choice((-3, 0, 0, 1, 1000))), port

    def _held(self) -> bytes:
        """What was held back comes, or something is."""
        if self._held_back and self._random.random() < 0.7:
            at = self._random.randrange(len(self._held_back))
            return self._held_back.pop(at)
        self._held_back.append(
            self._peer.turn() if self._random.random() < 0.5 else self._peer.value()
        )
        return self._peer.value()

    def _wrong_port(self) -> bytes:
        peer = self._peer
        wrong = Entry(self._random.choice((3, 4, 77, 65535)), 1, 0, array(b"\x00"))
        return peer.value(entries=self._random.choice(([wrong], [peer.entry(0), wrong])))

    def _bad_value(self) -> bytes:
        peer = self._peer
        number = self._random.choice((0, 2))
        value = self._random.choice(list((BAD_MOTIONS, {}, BAD_YAWS)[number]))
        good = self._random.choice(list((MOTIONS, {}, YAWS)[number]))
        bad = peer.entry(number, values=self._random.choice((array(value), array(good, value))))
        good_one = peer.entry(2 - number)
        return peer.value(entries=self._random.choice(([bad], [bad, good_one], [good_one, bad])))

    def _no_step(self) -> bytes:
        """A step whose body is none, or none of this many ports."""
        one, other = self._peer.entry(0), self._peer.entry(2)
        body, ports = self._random.choice(
            (
                (step(one, other), 1),
                (step(one, other), 3),
                (step(one, other)[:-1], 2),
                (step(one, other)[:30], 2),
                (step(one)[:21], 1),
                (step(one) + b"\x00", 1),
                (b"", 0),
                (step(one, one), 2),
                (step(one._replace(sequence=0)), 1),
                (step(one._replace(after=one.sequence)), 1),
                (step(one._replace(values=b"")), 1),
                (step(one._replace(values=b"\x90")), 1),
                (step(other._replace(values=next(iter(YAWS)))), 1),
            )
        )
        return self._peer.honest(STEP, body=body, ports=ports)

    def _noise(self) -> bytes:
        plain = self._random.randbytes(self._random.randrange(300))
        return plain + tag(plain)

    def _again(self) -> bytes:
        return self._random.choice(self._peer.recorded) if self._peer.recorded else b""

    def _overtaken(self, most: int = 200, *, late: int = 0) -> bytes:
        """A frame that was sent before, and had been lost until now."""
        counter = max(1, self._peer.counter - self._random.randrange(1, most))
        late = late or self._random.randrange(MS, 300 * MS)
        return self._peer.value(counter=counter, late=late, old=0)

    def _another_s_greeting(self) -> bytes:
        return self._peer.honest(HELLO, peer=0, session=self._word(), body=self._fits)

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
        self._lacks.append(self._end.lacks())
        before, self._refused = self._refused, self._end.refused()
        new = self._refused - before
        if new.total() > 1:
            return f"{dict(new)} and {values}"
        return next(iter(new), ACCEPTED if values else NO_VALUE)

    def expected(self, attempt: Attempt) -> str:
        """The reference's."""
        verdict = self._rules.verdict(attempt.datagram, attempt.at)
        self._should_lack.append(self._rules.lacks(attempt.at))
        return verdict

    def taken(self) -> tuple[object, object]:
        """What entered, and what should have."""
        names = ("controller:motion", "controller:turn", "controller:yaw")
        order = self._rules.order
        values = [(names[port], value) for port, value in order.values]
        expected = {"overtaken": order.overtaken, "dropped": order.dropped}
        found = (self._found, self._end.counted(), self._lacks)
        return found, (values, expected, self._should_lack)

    def counted(self) -> dict[str, int]:
        """By reason."""
        return dict(self._end.refused())
