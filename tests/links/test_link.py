"""A run's end of a link, played against the other end frame by frame, on a clock of the test."""

from collections.abc import Callable, Sequence

import pytest

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.inbox import Bag
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.links.cut.counts import Carried, report
from firmware_runtime.links.cut.cut import Terms
from firmware_runtime.links.cut.delivery import MOST_WAITING
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.wire import (
    Entry,
    Farewell,
    Frame,
    Greeting,
    Kind,
    body_of,
    decoded,
    encoded,
    entries_of,
    farewell_of,
)
from firmware_runtime.runs.end_link import LinkedEnd
from firmware_runtime.statistics.file_header import RunState
from tests.support.link_rig import Way, link_of, role_of

TERMS = Terms()
LIMITS = {"mind.command": (-1.0, 1.0)}


PORTS = {"mind.command": float, "wheels.turned": float, "wheels.slip": float}


class Ends:
    """The end with the wheels, and the frames of the other one."""

    def __init__(
        self, terms: Terms = TERMS, *, takes_old: bool = False, role: str = "wheels"
    ) -> None:
        self.now = SECOND
        self.bad: list[str] = []
        self.said: list[str] = []
        self.byes: list[Farewell] = []
        self.sent: list[bytes] = []
        self.way = Way(self.sent.append)
        self.link = link_of(
            role_of(PORTS, role),
            self.way,
            terms,
            lambda: self.now,
            limits=LIMITS,
            takes_old=takes_old,
            log=self.said.append,
        )
        self.cut = self.link.cut
        self.link.on_bad = self.bad.append
        self.link.on_bye = self.byes.append
        leaving = tuple(each.number for each in self.cut.entering)
        self.other = Peer(
            5, Greeting(self.cut.digest, leaving, "rover", "controller", "", 0), TERMS.timeout
        )
        self.sequence = self.steps = 0

    def between_steps(self) -> list[Frame]:
        """What it sends now."""
        self.link.between_steps(self.now, 0)
        frames = [decoded(each) for each in self.sent]
        self.sent.clear()
        return frames

    def get(self, *frames: Frame) -> list[object]:
        """The values that enter its model when these arrive."""
        return [value for bag in self.events(*frames) for _, value in bag]

    def events(self, *frames: Frame) -> Sequence[Bag]:
        """The events for its model when these arrive."""
        self.way.waits.extend(map(encoded, frames))
        return self.link.events()

    def meet(self) -> "Ends":
        self.get(self.other.hello(self.now))
        for frame in self.between_steps():
            self.other.accept(frame, self.now)
        self.get(self.other.hello(self.now))
        assert self.link.peer.is_good(self.now)
        return self

    def command(self, value: float, *, age: int = 0, port: int = 0, after: int = 0) -> Frame:
        """A step of the other end, in which a value left."""
        self.sequence += 1
        return self.step(Entry(port, self.sequence, after, self.body(value)), age=age)

    def step(self, *entries: Entry, age: int = 0) -> Frame:
        """A step of the other end."""
        self.steps += 1
        return self.other.frame(Kind.STEP, self.now, body_of(entries))._replace(
            ports=len(entries), origin=self.now - age, step=self.steps
        )

    def body(self, *values: float) -> bytes:
        return self.cut.entering[0].packed(values)

    def refused(self) -> dict[Reason, int]:
        return {reason: count for reason, count in self.link.counts.refused.items() if count > 0}


@pytest.fixture
def ends() -> Ends:
    return Ends().meet()


def test_a_command_enters_the_model(ends: Ends) -> None:
    assert ends.get(ends.command(0.5)) == [0.5]
    ends.between_steps()
    assert ends.link.counts.received == 1


def test_of_several_in_one_pass_the_newest_enters(ends: Ends) -> None:
    assert ends.get(*(ends.command(value) for value in (0.1, 0.2, 0.3))) == [0.3]
    ends.between_steps()
    assert (ends.link.counts.received, ends.link.counts.dropped) == (1, 2)
    kept = Ends(Terms(keep=2)).meet()
    assert kept.get(*(kept.command(value) for value in (0.1, 0.2, 0.3))) == [0.2, 0.3]


def test_a_value_that_was_sent_again_enters_once(ends: Ends) -> None:
    first = ends.command(0.5)
    again = ends.step(*entries_of(first))
    assert ends.get(first) == [0.5]
    assert ends.get(again) == []
    assert ends.refused() == {}
    ends.between_steps()
    assert ends.link.counts.overtaken == 0


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


def test_a_value_that_a_newer_one_overtook_is_counted_and_refused_is_it_not(ends: Ends) -> None:
    first = ends.command(0.1)
    ends.now += MILLISECOND
    assert ends.get(ends.command(0.2)) == [0.2]
    assert ends.get(first) == []
    ends.between_steps()
    assert ends.link.counts.overtaken == 1
    assert (ends.refused(), ends.bad) == ({}, [])


def test_an_overtaken_command_that_is_too_old_turns_nothing_off(ends: Ends) -> None:
    ends.get(ends.step(Entry(0, 2, 0, ends.body(0.2))))
    assert ends.get(ends.step(Entry(0, 1, 0, ends.body(0.1)), age=SECOND)) == []
    assert (ends.refused(), ends.bad) == ({}, [])


def test_steps_that_are_read_together_are_put_in_order_each_an_event_of_its_own() -> None:
    ends = Ends(Terms(keep=2)).meet()
    first, second, third = (ends.command(value) for value in (0.1, 0.2, 0.3))
    events = ends.events(third, second, first)
    assert [[value for _, value in event] for event in events] == [[0.2], [0.3]]


def test_what_left_in_one_step_arrives_as_one_event() -> None:
    ends = Ends(role="mind").meet()
    steps = (
        ends.step(Entry(1, 1, 0, ends.body(1.0, 2.0)), Entry(2, 1, 0, ends.body(3.0))),
        ends.step(Entry(1, 2, 0, ends.body(4.0))),
    )
    [event] = ends.events(steps[0])
    assert [(port.name, value) for port, value in event] == [
        ("wheels:slip", 1.0),
        ("wheels:slip", 2.0),
        ("wheels:turned", 3.0),
    ]
    [event] = ends.events(steps[1])
    assert [(port.name, value) for port, value in event] == [("wheels:slip", 4.0)]


def test_nothing_of_a_step_enters_if_anything_in_it_is_refused() -> None:
    ends = Ends(role="mind").meet()
    sound, broken = ends.body(1.0), ends.body(float("nan"))
    assert ends.get(ends.step(Entry(1, 1, 0, sound), Entry(2, 1, 0, broken))) == []
    assert ends.get(ends.step(Entry(1, 2, 0, sound), Entry(9, 1, 0, sound))) == []
    assert ends.refused() == {Reason.NOT_FINITE: 1, Reason.UNKNOWN_PORT: 1}
    assert ends.get(ends.step(Entry(1, 1, 0, sound))) == [1.0], "it has not come, so far"


ORDERED = Terms(ordered=frozenset({"mind.command"}))


def test_of_an_ordered_port_each_waits_for_the_one_before_it() -> None:
    ends = Ends(ORDERED).meet()
    first, second, third = (ends.command(value, after=n) for n, value in enumerate((0.1, 0.2, 0.3)))
    assert ends.get(third) == []
    assert ends.get(first) == [0.1]
    events = ends.events(second)
    assert [[value for _, value in event] for event in events] == [[0.2], [0.3]]
    assert ends.get(ends.step(*entries_of(second))) == []
    assert (ends.refused(), ends.bad) == ({}, [])


def test_what_waits_too_long_for_a_lost_one_turns_outputs_off_and_holds_up_nothing_more() -> None:
    ends = Ends(ORDERED).meet()
    ends.get(ends.command(0.1))
    ends.command(0.2, after=1)
    assert ends.get(ends.command(0.3, after=2)) == []
    ends.now += TERMS.timeout + 1
    assert ends.get(ends.command(0.4, after=3)) == [0.4]
    assert ends.bad == ["what came before mind.command was lost"]
    ends.between_steps()
    assert ends.link.counts.dropped == 1


def test_one_of_an_ordered_port_that_is_too_old_turns_outputs_off_and_holds_up_nothing() -> None:
    ends = Ends(ORDERED).meet()
    ends.get(ends.command(0.1))
    assert ends.get(ends.command(0.2, after=1, age=TERMS.timeout + MILLISECOND)) == []
    assert len(ends.bad) == 1
    assert ends.get(ends.command(0.3, after=2)) == [0.3]
    assert ends.refused() == {Reason.TOO_OLD: 1}


def test_one_of_an_ordered_port_that_its_sender_gave_up_turns_outputs_off() -> None:
    ends = Ends(ORDERED).meet()
    ends.get(ends.command(0.1))
    ends.command(0.2, after=1)
    assert ends.get(ends.command(0.3, after=1)) == [0.3]
    assert ends.bad == ["1 of mind.command were lost"]


def test_so_many_steps_wait_and_no_more() -> None:
    ends = Ends(ORDERED).meet()
    ends.get(ends.command(0.0))
    ends.command(0.0, after=1)
    for _ in range(MOST_WAITING + 1):
        assert ends.bad == []
        ends.get(ends.command(0.1, after=ends.sequence))
    assert len(ends.bad) == 1
    ends.between_steps()
    counts = ends.link.counts
    assert (counts.received, counts.dropped) == (MOST_WAITING + 1, 1)


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
    take(ends.now, 0.5)
    [frame] = [each for each in ends.between_steps() if each.kind is Kind.STEP]
    assert (frame.ports, frame.origin, frame.step) == (1, ends.now, 1)
    [entry] = entries_of(frame)
    assert (entry.port, entry.sequence, entry.after) == (1, 1, 0)
    assert ends.cut.leaving[0].unpacked(entry.body) == [0.25, 0.5]


def test_an_end_that_has_nothing_to_say_shows_that_it_is_there(ends: Ends) -> None:
    ends.between_steps()
    beats = 0
    for _ in range(10):
        ends.now += 50 * MILLISECOND
        ends.get(ends.other.frame(Kind.HEARTBEAT, ends.now))
        beats += sum(each.kind is Kind.HEARTBEAT for each in ends.between_steps())
    assert beats in {4, 5}, "every 100 ms; one may be a greeting"


def test_an_end_whose_commander_is_gone_falls_silent_until_there_is_one(ends: Ends) -> None:
    ends.meet().between_steps()
    ends.link.why_silent = lambda _now: "no value has come at input place for 0.5 s"
    for _ in range(3):
        ends.now += SECOND // 10
        ends.get(ends.other.hello(ends.now))
        assert ends.between_steps() == []
    ends.link.why_silent = lambda _now: None
    assert ends.between_steps() != []


def test_what_the_other_end_says_at_its_end_is_handed_on(ends: Ends) -> None:
    ends.between_steps()
    farewell = Farewell("the target was reached", is_over=True, failed=False)
    ends.get(ends.other.bye(ends.now, farewell))
    assert ends.byes == [farewell]
    ends.between_steps()
    assert ends.bad == ["the controller has ended: the target was reached"]


FOUND = Ending("it is found", failed=False)
LOST = Ending("it is lost", failed=True)


@pytest.mark.parametrize(
    ("ending", "ends_both", "state", "said"),
    [
        (None, True, RunState.ENDED, (True, False)),
        (None, True, RunState.STOPPED, (False, False)),
        (None, False, RunState.ENDED, (False, False)),
        (FOUND, False, RunState.STOPPED, (True, False)),
        (LOST, True, RunState.FAILED, (True, True)),
    ],
)
def test_an_end_says_at_its_end_whether_the_other_one_is_over_too(
    ends: Ends, ending: Ending | None, state: RunState, said: tuple[bool, bool], *, ends_both: bool
) -> None:
    ends.between_steps()
    heard: list[Ending] = []
    executive = Executive(Atomic("wheels"), VirtualClock(), list)
    end = LinkedEnd(ends.link, executive, heard.append, ends.bad.append, ends_both=ends_both)
    end.say_goodbye(Outcome(state, "so it was"), ending)
    byes = {farewell_of(each.body) for each in map(decoded, ends.sent) if each.kind is Kind.BYE}
    assert byes == {Farewell("so it was", *said)}
    ends.sent.clear()
    for _ in range(2):
        ends.get(ends.other.bye(ends.now, Farewell("enough", is_over=True, failed=True)))
    assert heard == [Ending("enough", failed=True)]
    end.say_goodbye(Outcome(state, "so it was"), ending)
    assert ends.sent == [], "the other one knows"


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


def test_what_is_not_authentic_is_said_once_before_there_is_a_peer_and_then_only_counted() -> None:
    ends = Ends()
    for forged in (1, 40, 100_000):
        ends.get(decoded(report(Carried({Reason.FORGED: forged}))))
    (said,) = ends.said
    assert "signed with another key" in said
    assert ends.link.counts.refused[Reason.FORGED] == 100_000


def test_what_is_not_authentic_is_only_counted_while_there_is_a_peer() -> None:
    ends = Ends().meet()
    ends.said.clear()
    ends.get(decoded(report(Carried({Reason.FORGED: 40}))))
    assert ends.said == []
    assert ends.link.counts.refused[Reason.FORGED] == 40
