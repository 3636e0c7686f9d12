"""Frames of the honest peer of the robot's end, and such with one thing amiss."""

from collections.abc import Callable, Sequence
from random import Random
from typing import Final

from tests.support.hostile.frames import (
    KEY,
    MOTIONS,
    STEP,
    TURNS,
    YAWS,
    Entry,
    Fields,
    array,
    frame,
    step,
)
from tests.support.hostile.link_rules import MS

TURN: Final = 1


class PeerFrames:
    """Frames to the robot's session `robot`; `now` is its clock, by which the peer's is ahead."""

    def __init__(self, random: Random, now: Callable[[], int], robot: int) -> None:
        self.recorded: list[bytes] = []
        self._random = random
        self._now = now
        self._robot = robot
        self.begin_session()

    def begin_session(self) -> None:
        """Start the peer again."""
        self.session = self._random.getrandbits(64) or 1
        self.counter = self._sent_at = self._steps = 0
        self.sequences = [0, 0, 0]
        self.ahead = self._random.choice((0, 10**12, -(10**11), 123_456_789_123))

    def honest(
        self,
        kind: int,
        *,
        key: bytes | None = KEY,
        counter: int | None = None,
        late: int = 0,
        session: int | None = None,
        peer: int | None = None,
        body: bytes = b"",
        ports: int = 0,
        old: int = 0,
        flags: int = 0,
        missing: tuple[int, int, int] | None = None,
    ) -> bytes:
        """A frame of the peer, about a millisecond on its way; `late` ns more, if that is said.

        `missing` is for how long something is, its sequence and its port.
        """
        now = self._now()
        sent_at = max(now - self._random.randrange(200_000, MS), self._sent_at)
        if counter is None and late == 0:
            self._sent_at = sent_at
        if counter is None:
            self.counter += self._random.choice((1, 1, 1, 1, 3, 30))
            counter = self.counter
        way, held = now - sent_at + late, self._random.randrange(0, 20 * MS)
        sent_at += self.ahead - late
        self._steps += 1
        fields = Fields(
            kind,
            self.session if session is None else session,
            self._robot if peer is None else peer,
            counter,
            sent_at,
            now - 2 * way - held,
            held,
            origin=sent_at - old - self._random.randrange(2 * MS),
            step=self._steps,
            ports=ports,
            body=body,
            flags=flags,
        )
        if missing is not None:
            since, sequence, port = missing
            fields = fields._replace(
                missing_since=sent_at - since, missing=sequence, missing_port=port
            )
        made = frame(fields, key)
        if key is KEY and self._random.random() < 0.02:
            self.recorded = [*self.recorded[-500:], made]
        return made

    def value(
        self,
        *,
        entries: Sequence[Entry] | None = None,
        sequence_back: int = 0,
        key: bytes | None = KEY,
        counter: int | None = None,
        late: int = 0,
        old: int = 0,
        session: int | None = None,
        peer: int | None = None,
        missing: tuple[int, int, int] | None = None,
    ) -> bytes:
        """A step, as a rule of one or two ports of which the newest counts."""
        if entries is None:
            numbers = self._random.choice(((0,), (2,), (0, 2), (2, 0)))
            entries = [self.entry(number, back=sequence_back) for number in numbers]
        return self.honest(
            STEP,
            key=key,
            counter=counter,
            late=late,
            session=session,
            peer=peer,
            body=step(*entries),
            ports=len(entries),
            old=old,
            missing=missing,
        )

    def entry(self, number: int, *, back: int = 0, values: bytes | None = None) -> Entry:
        """What leaves by a port: the next of it, or with a sequence so far back."""
        self.sequences[number] += 1
        if values is None:
            some = list((MOTIONS, TURNS, YAWS)[number])
            values = array(*self._random.choices(some, k=self._random.choice((1, 1, 1, 3))))
        return Entry(number, max(1, self.sequences[number] - back), 0, values)

    def turn(self, *, gap: int = 0, skip: int = 0) -> bytes:
        """A step with a turn and a yaw; `gap` turns were given up, `skip` are still to come."""
        before = self.sequences[TURN]
        self.sequences[TURN] += gap + skip
        turn = self.entry(TURN)._replace(after=before + skip)
        return self.value(entries=[turn, self.entry(2)])
