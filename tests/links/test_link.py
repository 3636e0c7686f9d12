"""A run's end of a link, played against the other end frame by frame, on a clock of the test."""

from collections import deque
from collections.abc import Callable

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.loop import Executive
from firmware_runtime.links.cut.counts import Carried, report
from firmware_runtime.links.cut.cut import Cut, cut_of
from firmware_runtime.links.cut.greeting import Farewell, Greeting
from firmware_runtime.links.cut.link import Link, Terms
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.wire import Frame, Kind, decoded, encoded

TERMS = Terms()
LIMITS = {"mind.command": (-1.0, 1.0)}


class Wheels(Atomic):
    def __init__(self) -> None:
        super().__init__("wheels")
        self.command = self.in_port("command", float)
        self.turned = self.out_port("turned", float)


class Mind(Atomic):
    def __init__(self) -> None:
        super().__init__("mind")
        self.turned = self.in_port("turned", float)
        self.command = self.out_port("command", float)


def part(name: str) -> Part:
    whole = Coupled("rover")
    wheels, mind = whole.add(Wheels()), whole.add(Mind())
    whole.couple(wheels.turned, mind.turned)
    whole.couple(mind.command, wheels.command)
    return part_of(whole, [name])


class Way:
    """A way in this process: what the link sends is in `sent`, what it is to get in `waits`."""

    def __init__(self) -> None:
        self.sent: deque[bytes] = deque()
        self.waits: deque[bytes] = deque()

    def fileno(self) -> int:
        raise AssertionError("nothing waits here")

    def receive(self) -> bytes | None:
        return self.waits.popleft() if self.waits else None

    def send(self, frame: bytes) -> None:
        self.sent.append(frame)

    def close(self) -> None:
        pass


class Ends:
    """The end with the wheels, and the frames of the other one."""

    def __init__(self, terms: Terms = TERMS, *, takes_old: bool = False) -> None:
        self.now = SECOND
        self.bad: list[str] = []
        self.byes: list[Farewell] = []
        self.way = Way()
        own = part("wheels")
        self.cut: Cut = cut_of(own, ["mind.command", "wheels.turned"], LIMITS)
        executive = Executive(own.model, VirtualClock(), configuration=Configuration(has_link=True))
        self.link = Link(
            executive,
            self.cut,
            own.entering,
            self.way,
            terms,
            board="rover",
            role="robot",
            takes_old=takes_old,
            log=lambda _: None,
            time=lambda: self.now,
        )
        self.link.on_bad = self.bad.append
        self.link.on_bye = self.byes.append
        self.other = Peer(
            5, Greeting(self.cut.digest, (0,), "rover", "controller", "", 0), TERMS.timeout
        )
        self.sequence = 0

    def between_steps(self) -> list[Frame]:
        """What it sends now."""
        self.link.between_steps(self.now, 0)
        frames = [decoded(each) for each in self.way.sent]
        self.way.sent.clear()
        return frames

    def get(self, *frames: Frame) -> list[object]:
        """The values that enter its model when these arrive."""
        self.way.waits.extend(map(encoded, frames))
        return [value for _, value in self.link.receive()]

    def meet(self) -> "Ends":
        self.get(self.other.hello(self.now))
        for frame in self.between_steps():
            self.other.accept(frame, self.now)
        self.get(self.other.hello(self.now))
        assert self.link.peer.is_good(self.now)
        return self

    def command(self, value: float, *, age: int = 0, port: int = 0) -> Frame:
        """A value of the other end."""
        self.sequence += 1
        body = self.cut.entering[0].packing.pack(value)
        return self.other.frame(
            Kind.VALUE,
            self.now,
            port=port,
            origin=self.now - age,
            sequence=self.sequence,
            body=body,
        )

    def refused(self) -> dict[Reason, int]:
        return {reason: count for reason, count in self.link.counts.refused.items() if count > 0}


@pytest.fixture
def ends() -> Ends:
    return Ends().meet()


def test_a_command_enters_the_model(ends: Ends) -> None:
    assert ends.get(ends.command(0.5)) == [0.5]
    assert ends.link.counts.received == 1


def test_of_several_in_one_pass_the_newest_enters(ends: Ends) -> None:
    assert ends.get(*(ends.command(value) for value in (0.1, 0.2, 0.3))) == [0.3]
    assert (ends.link.counts.received, ends.link.counts.dropped) == (1, 2)
    kept = Ends(Terms(keep=2)).meet()
    assert kept.get(*(kept.command(value) for value in (0.1, 0.2, 0.3))) == [0.2, 0.3]


def test_a_value_that_was_sent_again_enters_once(ends: Ends) -> None:
    first = ends.command(0.5)
    again = ends.command(0.5)._replace(sequence=first.sequence)
    assert ends.get(first) == [0.5]
    assert ends.get(again) == []
    assert ends.refused() == {}


def test_an_old_command_is_refused_and_the_link_is_bad(ends: Ends) -> None:
    assert ends.get(ends.command(0.5, age=SECOND)) == []
    assert ends.refused() == {Reason.TOO_OLD: 1}
    assert ends.bad == ["mind.command was 1.000 s old"]
    assert ends.link.why_not(0) is not None


def test_an_old_value_that_is_retained_enters_where_nothing_is_driven() -> None:
    terms = Terms(retain=frozenset({"mind.command"}))
    taking, driving = Ends(terms, takes_old=True).meet(), Ends(terms).meet()
    assert taking.get(taking.command(0.5, age=SECOND)) == [0.5]
    assert driving.get(driving.command(0.5, age=SECOND)) == []


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (float("nan"), Reason.NOT_FINITE),
        (float("inf"), Reason.NOT_FINITE),
        (1.5, Reason.OUT_OF_LIMITS),
    ],
)
def test_a_value_that_no_wheel_can_take_is_refused(
    ends: Ends, value: float, reason: Reason
) -> None:
    assert ends.get(ends.command(value)) == []
    assert ends.refused() == {reason: 1}
    assert ends.get(ends.command(1.0)) == [1.0], "the link is as good as before"


def test_what_is_no_value_of_the_cut_is_refused(ends: Ends) -> None:
    assert ends.get(ends.command(0.5, port=1)) == [], "its own port"
    assert ends.get(ends.command(0.5, port=9)) == []
    assert ends.get(ends.command(0.5)._replace(body=b"\xc1")) == []
    ends.way.waits.append(b"nonsense")
    assert ends.get() == []
    assert ends.refused() == {Reason.UNKNOWN_PORT: 2, Reason.MALFORMED: 2}


def test_a_counter_that_goes_back_makes_the_link_bad(ends: Ends) -> None:
    ends.get(ends.command(0.1))
    ends.now += MILLISECOND
    assert ends.get(ends.command(0.2)._replace(counter=1)) == []
    assert ends.refused() == {Reason.WENT_BACK: 1}
    assert len(ends.bad) == 1


def test_a_datagram_that_was_overtaken_is_only_refused(ends: Ends) -> None:
    first = ends.command(0.1)
    ends.now += MILLISECOND
    assert ends.get(ends.command(0.2), first) == [0.2]
    assert ends.refused() == {Reason.STALE: 1}
    assert ends.bad == []


def test_silence_makes_it_bad_and_it_must_be_good_for_a_while(ends: Ends) -> None:
    ends.between_steps()
    ends.now += TERMS.timeout
    ends.between_steps()
    assert ends.bad == ["the controller has been silent for 0.5 s"]
    for since in range(6):
        ends.get(ends.other.frame(Kind.HEARTBEAT, ends.now))
        ends.between_steps()
        is_long_enough = since * 100 * MILLISECOND >= TERMS.good
        assert (ends.link.why_not(0) is None) is is_long_enough
        ends.now += 100 * MILLISECOND
    assert len(ends.bad) == 1


def test_what_leaves_is_sent_in_the_next_pass(ends: Ends) -> None:
    ends.between_steps()
    take = ends.link.leaves(ends.cut.leaving[0])
    take(ends.now, 0.25)
    [frame] = [each for each in ends.between_steps() if each.kind is Kind.VALUE]
    assert (frame.port, frame.origin, frame.sequence) == (1, ends.now, 1)
    assert ends.cut.leaving[0].packing.unpack(frame.body) == 0.25


def test_an_end_that_has_nothing_to_say_shows_that_it_is_there(ends: Ends) -> None:
    ends.between_steps()
    beats = 0
    for _ in range(10):
        ends.now += 50 * MILLISECOND
        ends.get(ends.other.frame(Kind.HEARTBEAT, ends.now))
        beats += sum(each.kind is Kind.HEARTBEAT for each in ends.between_steps())
    assert beats in {4, 5}, "every 100 ms; one may be a greeting"


def test_what_the_other_end_says_at_its_end_is_handed_on(ends: Ends) -> None:
    ends.between_steps()
    farewell = Farewell("the target was reached", is_over=True, failed=False)
    ends.get(ends.other.bye(ends.now, farewell))
    assert ends.byes == [farewell]
    ends.between_steps()
    assert ends.bad == ["the controller has ended: the target was reached"]


def test_what_a_carrier_refused_is_counted_too(ends: Ends) -> None:
    ends.way.waits.append(report(Carried({Reason.FORGED: 4}, dropped=2)))
    assert ends.get() == []
    assert ends.refused() == {Reason.FORGED: 4}


def test_a_sentence_says_that_the_other_end_is_cut_elsewhere() -> None:
    said: list[str] = []
    ends = Ends()
    log: Callable[[str], None] = said.append
    ends.link._log = log
    ends.other.own = ends.other.own.__class__(bytes(32), (0,), "rover", "controller", "", 0)
    for _ in range(3):
        ends.get(ends.other.hello(ends.now))
    assert ends.refused() == {Reason.OTHER_CUT: 3}
    assert len(said) == 1
