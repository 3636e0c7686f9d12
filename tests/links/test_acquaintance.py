"""How a sender gets to know a bridge with a key, and which of its answers it believes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.bridge.admission import MOST_AGE, NotAcquainted, Signed
from firmware_runtime.links.bridge.bridge_end import Acquaintance
from firmware_runtime.links.bridge.envelope import Refused, new_name
from sim_doubles.clock import ManualClock

KEY = bytes(range(32))


class Pair:
    """A sender and a bridge; each has a clock of its own."""

    def __init__(self) -> None:
        self.bridge_clock = ManualClock(1_000 * SECOND)
        self.bridge = Signed(KEY, self.bridge_clock)
        self.now = 5 * SECOND
        self.sender = Acquaintance(KEY)

    def pass_by(self, span: int) -> None:
        self.now += span
        self.bridge_clock.advance(span)

    def meet(self) -> None:
        assert self.sender.believe(self.hello_answer(), self.now) is None

    def hello_answer(self) -> bytes:
        with pytest.raises(NotAcquainted) as why:
            self.bridge.admit(self.sender.hello(self.now))
        return why.value.answer

    def refused(self, answer: bytes) -> str:
        with pytest.raises(Refused) as why:
            self.sender.believe(answer, self.now)
        return why.value.reason


@pytest.fixture
def pair() -> Pair:
    return Pair()


def test_after_one_hello_both_sides_believe_each_other(pair: Pair) -> None:
    pair.meet()
    pair.pass_by(3600 * SECOND)
    admitted = pair.bridge.admit(pair.sender.ask(b"one", pair.now))
    assert admitted == (pair.sender.name, b"one")
    answer = pair.bridge.signed(admitted.sender, b"two")
    assert pair.sender.believe(answer, pair.now) == b"two"
    assert (pair.bridge.refused, pair.sender.refused) == ({"unacquainted": 1}, {})


def test_what_was_held_back_is_stale_on_either_side(pair: Pair) -> None:
    pair.meet()
    ask = pair.sender.ask(b"one", pair.now)
    answer = pair.bridge.signed(pair.sender.name, b"two")
    pair.pass_by(MOST_AGE + 1)
    with pytest.raises(Refused, match="stale"):
        pair.bridge.admit(ask)
    assert pair.refused(answer) == "stale"


def test_answers_that_prove_nothing_are_not_believed(pair: Pair) -> None:
    pair.meet()
    taken = pair.bridge.signed(pair.sender.name, b"1")
    assert pair.sender.believe(taken, pair.now) == b"1"
    elsewhere = Signed(KEY, pair.bridge_clock)
    forger = Signed(bytes(reversed(KEY)), pair.bridge_clock)
    for answer, reason in (
        (taken, "replayed"),
        (pair.bridge.signed(new_name(), b"2"), "for another"),
        (elsewhere.signed(pair.sender.name, b"2"), "another bridge"),
        (forger.signed(pair.sender.name, b"2"), "forged"),
        (pair.sender.ask(b"2", pair.now), "reflected"),
        (b'{"port": "imu.sample"}', "malformed"),
    ):
        assert pair.refused(answer) == reason
        assert pair.sender.refused[reason] == 1
    assert pair.sender.is_made


def test_an_answer_to_an_earlier_hello_makes_nothing_known(pair: Pair) -> None:
    earlier = pair.hello_answer()
    later = pair.hello_answer()
    assert pair.refused(earlier) == "late"
    assert not pair.sender.is_made
    assert pair.sender.believe(later, pair.now) is None
    assert pair.sender.is_made


def test_a_bridge_that_begins_again_becomes_known_by_what_it_did_not_take(pair: Pair) -> None:
    pair.meet()
    pair.bridge = Signed(KEY, pair.bridge_clock)
    with pytest.raises(NotAcquainted) as why:
        pair.bridge.admit(pair.sender.ask(b"one", pair.now))
    assert pair.sender.believe(why.value.answer, pair.now) is None
    assert pair.bridge.admit(pair.sender.ask(b"one", pair.now)).content == b"one"


def test_a_bridge_whose_clock_stood_still_is_met_again(pair: Pair) -> None:
    pair.meet()
    pair.now += 3600 * SECOND
    with pytest.raises(Refused, match="ahead"):
        pair.bridge.admit(pair.sender.ask(b"one", pair.now))
    pair.meet()
    assert pair.bridge.admit(pair.sender.ask(b"one", pair.now)).content == b"one"


@pytest.mark.slow
@given(st.lists(st.integers(0, MOST_AGE // 2), max_size=20))
def test_whatever_the_way_takes_all_arrives_that_is_young(ways: list[int]) -> None:
    pair = Pair()
    pair.meet()
    for way in ways:
        ask = pair.sender.ask(b"one", pair.now)
        pair.pass_by(way)
        answer = pair.bridge.signed(pair.bridge.admit(ask).sender, b"two")
        pair.pass_by(way // 4)
        assert pair.sender.believe(answer, pair.now) == b"two"
