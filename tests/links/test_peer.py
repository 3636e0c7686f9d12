"""Two ends of a link find each other, and take nothing that is not the other's, and new."""

from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.cut.peer import Peer
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.window import RECENT, SIZE
from firmware_runtime.links.cut.wire import Farewell, Frame, Greeting, Kind

TIMEOUT = SECOND // 2
DIGEST = bytes(32)


def peer(session: int, leaving: int, digest: bytes = DIGEST) -> Peer:
    role = ("robot", "controller")[leaving]
    return Peer(session, Greeting(digest, (leaving,), "rover", role, "", 0), TIMEOUT)


@dataclass
class Pair:
    """Two ends whose clocks differ by `offset`, and a way of `delay` between them."""

    robot: Peer = field(default_factory=lambda: peer(1, 0))
    controller: Peer = field(default_factory=lambda: peer(2, 1))
    offset: int = 7_000 * SECOND
    delay: int = 2 * MILLISECOND
    now: int = SECOND

    def to_controller(self, frame: Frame) -> bool:
        self.now += self.delay
        return self.controller.accept(frame, self.now + self.offset)

    def to_robot(self, frame: Frame) -> bool:
        self.now += self.delay
        return self.robot.accept(frame, self.now)

    def from_robot(self, kind: Kind = Kind.HEARTBEAT) -> Frame:
        return (
            self.robot.hello(self.now) if kind is Kind.HELLO else self.robot.frame(kind, self.now)
        )

    def from_controller(self, kind: Kind = Kind.HEARTBEAT) -> Frame:
        at = self.now + self.offset
        return self.controller.hello(at) if kind is Kind.HELLO else self.controller.frame(kind, at)

    def meet(self) -> "Pair":
        self.to_controller(self.from_robot(Kind.HELLO))
        self.to_robot(self.from_controller(Kind.HELLO))
        self.to_controller(self.from_robot(Kind.HELLO))
        return self

    def reason(self, frame: Frame) -> Reason:
        """Why the robot refuses a frame."""
        with pytest.raises(Refused) as refused:
            self.to_robot(frame)
        return refused.value.reason


def test_both_are_good_after_three_greetings() -> None:
    pair = Pair().meet()
    assert pair.robot.is_good(pair.now)
    assert pair.controller.is_good(pair.now + pair.offset)
    assert not pair.robot.wants_hello or not pair.controller.wants_hello


@pytest.mark.parametrize("first_lost", [0, 1, 2])
def test_a_greeting_that_is_lost_is_made_up_for(first_lost: int) -> None:
    pair, sent = Pair(), 0
    for _ in range(4):
        for make, carry in (
            (pair.from_robot, pair.to_controller),
            (pair.from_controller, pair.to_robot),
        ):
            frame = make(Kind.HELLO)
            if sent != first_lost:
                carry(frame)
            sent += 1
    assert pair.robot.is_good(pair.now)
    assert pair.controller.is_good(pair.now + pair.offset)


def test_the_other_clock_is_known_to_half_a_round_trip() -> None:
    pair = Pair().meet()
    for _ in range(3):
        pair.to_robot(pair.from_controller())
        pair.to_controller(pair.from_robot())
    assert pair.robot.clock.round_trip is not None
    offset = pair.robot.clock.offset
    assert offset is not None
    assert abs(offset - pair.offset) <= 2 * pair.delay
    age = pair.robot.clock.age(pair.now, pair.now + pair.offset - 30 * MILLISECOND)
    assert age is not None
    assert abs(age - 30 * MILLISECOND) <= 2 * pair.delay


def test_what_was_accepted_is_refused_when_it_comes_again() -> None:
    pair = Pair().meet()
    first, second, third = (pair.from_controller() for _ in range(3))
    for frame in (second, first, third):
        assert pair.to_robot(frame)
        assert pair.reason(frame) is Reason.REPLAYED
    assert pair.reason(second) is Reason.REPLAYED
    assert pair.robot.is_good(pair.now)


def test_a_frame_that_was_overtaken_is_accepted_once() -> None:
    pair = Pair().meet()
    sent = [pair.from_controller() for _ in range(SIZE + 1)]
    pair.to_robot(sent[-1])
    for frame in reversed(sent[:-1]):
        pair.now -= pair.delay
        assert pair.to_robot(frame)
    pair.now -= pair.delay
    assert pair.reason(sent[0]) is Reason.REPLAYED


def test_what_is_recorded_and_comes_long_after_is_stale_and_what_was_sent_just_now_went_back() -> (
    None
):
    pair = Pair().meet()
    recorded = pair.from_controller()
    newest = pair.from_controller()._replace(counter=recorded.counter + SIZE + 1)
    pair.to_robot(newest._replace(sent_at=recorded.sent_at + RECENT))
    assert pair.reason(recorded) is Reason.STALE
    assert pair.reason(recorded._replace(sent_at=recorded.sent_at + 1)) is Reason.WENT_BACK


def test_what_was_sent_before_a_bye_does_not_bring_its_sender_back() -> None:
    pair = Pair().meet()
    overtaken = pair.from_controller()
    farewell = Farewell("SIGTERM", is_over=False, failed=False)
    pair.to_robot(pair.controller.bye(pair.now + pair.offset, farewell))
    assert pair.reason(overtaken) is Reason.STALE
    assert not pair.robot.is_good(pair.now)


def test_a_late_frame_does_not_spoil_the_round_trip() -> None:
    pair = Pair().meet()
    late = pair.from_controller()
    newest = pair.from_controller()
    pair.to_robot(newest)
    pair.now += 50 * MILLISECOND
    pair.to_robot(late)
    answer = pair.from_robot()
    assert answer.echo == newest.sent_at
    assert answer.held == 50 * MILLISECOND + pair.delay


def test_a_counter_that_goes_back_later_is_no_replay() -> None:
    pair = Pair().meet()
    pair.to_robot(pair.from_controller())
    later = pair.from_controller()._replace(counter=1, sent_at=pair.now + pair.offset)
    assert pair.reason(later) is Reason.WENT_BACK
    earlier = pair.from_controller()._replace(sent_at=pair.now + pair.offset - SECOND // 3)
    assert pair.reason(earlier) is Reason.WENT_BACK


def test_its_own_frames_are_replays() -> None:
    pair = Pair().meet()
    assert pair.reason(pair.from_robot()) is Reason.REPLAYED


def test_what_is_meant_for_another_session_is_refused() -> None:
    pair = Pair().meet()
    assert pair.reason(pair.from_controller()._replace(peer=77)) is Reason.WRONG_SESSION
    assert pair.reason(pair.from_controller()._replace(session=77)) is Reason.WRONG_SESSION
    assert pair.reason(pair.from_controller()._replace(peer=0)) is Reason.WRONG_SESSION


def test_an_end_that_is_cut_elsewhere_is_refused() -> None:
    pair = Pair(controller=peer(2, 1, bytes(31) + b"x"))
    assert pair.reason(pair.from_controller(Kind.HELLO)) is Reason.OTHER_CUT
    pair = Pair(controller=peer(2, 0))
    assert pair.reason(pair.from_controller(Kind.HELLO)) is Reason.OTHER_CUT, "the same side"


def test_an_old_frame_is_refused() -> None:
    pair = Pair().meet()
    pair.to_robot(pair.from_controller())
    old = pair.from_controller()
    pair.now += TIMEOUT
    assert pair.reason(old) is Reason.TOO_OLD


def test_a_bye_is_never_too_old() -> None:
    pair = Pair().meet()
    pair.to_robot(pair.from_controller())
    farewell = Farewell("the target was reached", is_over=True, failed=False)
    bye = pair.controller.bye(pair.now + pair.offset, farewell)
    pair.now += 10 * TIMEOUT
    assert pair.to_robot(bye)
    assert pair.robot.farewell == farewell
    assert not pair.robot.is_good(pair.now)


def test_silence_ends_what_was_good_and_any_later_frame_begins_it_again() -> None:
    pair = Pair().meet()
    pair.now += TIMEOUT
    assert not pair.robot.is_good(pair.now)
    assert pair.robot.silences == 1
    assert "controller has been silent" in (pair.robot.why_bad(pair.now) or "")
    pair.to_robot(pair.from_controller())
    assert pair.robot.good_since == pair.now


def test_a_silence_begins_when_the_last_frame_was_sent_however_late_it_arrived() -> None:
    pair = Pair().meet()
    pair.to_robot(pair.from_controller())
    said_at = pair.now
    pair.delay = 300 * MILLISECOND
    pair.to_robot(pair.from_controller())
    assert pair.now > said_at + TIMEOUT // 2
    assert pair.robot.silent_at <= said_at + TIMEOUT
    assert pair.robot.is_good(pair.robot.silent_at - 1)
    assert not pair.robot.is_good(pair.robot.silent_at)


@pytest.mark.parametrize("drift", [0, 3 * SECOND, -3 * SECOND])
def test_ends_that_were_silent_to_each_other_find_each_other_again(drift: int) -> None:
    pair = Pair().meet()
    pair.now += 10 * TIMEOUT
    pair.offset += drift
    _greet_until_good(pair)
    assert pair.to_robot(pair.from_controller())
    assert pair.to_controller(pair.from_robot())


def test_a_second_controller_that_went_again_keeps_the_first_from_nothing() -> None:
    pair = Pair().meet()
    second = peer(3, 1).hello(pair.now)
    assert not pair.to_robot(second)
    pair.from_robot(Kind.HELLO)
    pair.now += 10 * TIMEOUT
    _greet_until_good(pair)


def test_a_robot_that_never_answered_does_not_keep_another_away() -> None:
    pair = Pair()
    pair.to_controller(pair.from_robot(Kind.HELLO))
    assert pair.from_controller(Kind.HELLO).peer == 1
    pair.robot = peer(4, 0)
    _greet_until_good(pair)
    assert pair.controller.session_of_peer == 4


def _greet_until_good(pair: Pair) -> None:
    """Both greet, as ends do that are not good; a carrier hands on what is for its run only."""
    for _ in range(4):
        greeting = pair.from_controller(Kind.HELLO)
        if greeting.peer in {0, pair.robot.session}:
            pair.to_robot(greeting)
        greeting = pair.from_robot(Kind.HELLO)
        if greeting.peer in {0, pair.controller.session}:
            pair.to_controller(greeting)
    assert pair.robot.is_good(pair.now)
    assert pair.controller.is_good(pair.now + pair.offset)


def test_a_new_session_comes_only_in_the_place_of_a_silent_one() -> None:
    pair = Pair().meet()
    recorded = pair.from_controller()
    second = replace(pair, controller=peer(3, 1))
    with pytest.raises(Refused) as refused:
        second.meet()
    assert refused.value.reason is Reason.WRONG_SESSION
    second.now = pair.now + 2 * TIMEOUT
    second.meet()
    assert second.robot.session_of_peer == 3
    recorded = recorded._replace(counter=10_000, sent_at=second.now + second.offset)
    assert second.reason(recorded) is Reason.WRONG_SESSION, "of a former session"


def test_an_end_whose_other_end_has_another_peer_is_told_and_waits_for_that_to_end() -> None:
    pair = Pair().meet()
    second = replace(pair, controller=peer(3, 1))
    second.to_robot(second.from_controller(Kind.HELLO))
    assert not second.to_controller(second.from_robot(Kind.HELLO))
    at = second.now + second.offset
    assert second.controller.why_bad(at) == "the other end has another peer already"
    second.now += 2 * TIMEOUT
    _greet_until_good(second)
    assert second.robot.session_of_peer == 3
    assert not second.controller.is_taken


def test_after_a_bye_another_session_may_come_at_once() -> None:
    pair = Pair().meet()
    farewell = Farewell("SIGTERM", is_over=False, failed=False)
    pair.to_robot(pair.controller.bye(pair.now + pair.offset, farewell))
    assert pair.robot.why_bad(pair.now) == "the controller has ended: SIGTERM"
    second = replace(pair, controller=peer(3, 1)).meet()
    assert second.robot.session_of_peer == 3


def test_a_greeting_that_was_recorded_opens_nothing() -> None:
    pair = Pair().meet()
    greeting = pair.from_controller(Kind.HELLO)
    answer = pair.from_controller()
    late = Pair(robot=peer(1, 0), now=pair.now + 10 * SECOND)
    assert late.to_robot(greeting._replace(peer=0)) is False
    assert late.reason(answer) is Reason.TOO_OLD
    assert not late.robot.is_good(late.now)


@pytest.mark.slow
@given(
    st.lists(
        st.tuples(st.booleans(), st.integers(0, 5), st.booleans(), st.sampled_from(Kind)),
        max_size=60,
    )
)
def test_no_frame_is_accepted_twice_however_the_network_shuffles(
    events: list[tuple[bool, int, bool, Kind]],
) -> None:
    """Frames are late, lost, doubled and out of order; each end takes each of them once at most."""
    pair = Pair().meet()
    ways: dict[bool, list[Frame]] = {True: [], False: []}
    accepted: dict[bool, list[int]] = {True: [], False: []}
    for is_to_robot, take, is_kept, kind in events:
        way = ways[is_to_robot]
        if kind in {Kind.HEARTBEAT, Kind.STEP, Kind.HELLO}:
            way.append(pair.from_controller(kind) if is_to_robot else pair.from_robot(kind))
        if not way:
            continue
        frame = way[take % len(way)] if is_kept else way.pop(take % len(way))
        try:
            if (pair.to_robot if is_to_robot else pair.to_controller)(frame):
                accepted[is_to_robot].append(frame.counter)
        except Refused:
            pass
    for counters in accepted.values():
        assert len(counters) == len(set(counters)), "each once"
