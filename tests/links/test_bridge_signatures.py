"""Signed datagrams of a bridge: as docs/bridge.md shows them, what is taken, what is believed."""

import json
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.bridge.signatures import (
    MOST_AGE,
    MOST_AHEAD,
    MOST_SENDERS,
    UNKNOWN,
    Acquaintance,
    Admitted,
    Direction,
    Envelope,
    NotAcquainted,
    Refused,
    Signed,
    new_name,
    opened,
    sealed,
)
from sim_doubles.clock import ManualClock

DOCUMENT = Path(__file__).parents[2] / "docs" / "bridge.md"
KEY = bytes(range(32))
SENDER, BRIDGE = "0011223344556677", "8899aabbccddeeff"
EXAMPLES: list[tuple[Direction, Envelope]] = [
    ("ask", Envelope(SENDER, UNKNOWN, 1, 0, b"")),
    ("answer", Envelope(BRIDGE, SENDER, 1, 1_200_000_000, b'{"answers":1}')),
    (
        "ask",
        Envelope(SENDER, BRIDGE, 2, 1_230_000_000, b'{"port": "yaw_reference", "value": 0.5}'),
    ),
]


def test_the_datagrams_of_the_document_are_those_of_the_bridge() -> None:
    (shown,) = re.findall(
        r"<!-- checked by tests/links -->\n```text\n(.*?)```", DOCUMENT.read_text(), re.DOTALL
    )
    made = [sealed(KEY, direction, envelope) for direction, envelope in EXAMPLES]
    assert shown.encode() == b"".join(datagram + b"\n" for datagram in made)
    for (direction, envelope), datagram in zip(EXAMPLES, made, strict=True):
        assert opened(KEY, direction, datagram) == envelope


@pytest.mark.parametrize(
    ("was", "written"), [(b" 2 ", b" 02 "), (b" 2 ", b" +2 "), (b"\n", b"\r\n")]
)
def test_nothing_can_be_written_in_two_ways(was: bytes, written: bytes) -> None:
    datagram = sealed(KEY, *EXAMPLES[2])
    with pytest.raises(Refused):
        opened(KEY, "ask", datagram.replace(was, written, 1))


def test_a_number_of_more_than_63_bits_is_refused() -> None:
    datagram = sealed(KEY, "ask", EXAMPLES[2][1]._replace(counter=1 << 63))
    with pytest.raises(Refused, match="malformed"):
        opened(KEY, "ask", datagram)


# What the bridge takes ----------------------------------------------------------------------------

OTHER = bytes(range(1, 33))
ASKS = b'{"port": "yaw_reference", "value": 0.5}'


class Door:
    """A bridge's admission, and a sender that knows its name."""

    def __init__(self) -> None:
        self.clock = ManualClock(10 * MOST_AGE)
        self.admission = Signed(KEY, self.clock)
        self.sender = new_name()

    def ask(
        self, counter: int, age: int = 0, *, sender: str = "", receiver: str = "", key: bytes = KEY
    ) -> bytes:
        names = sender or self.sender, receiver or self.admission.name
        return sealed(key, "ask", Envelope(*names, counter, self.clock() - age, ASKS))

    def refused(self, datagram: bytes) -> str:
        with pytest.raises(Refused) as why:
            self.admission.admit(datagram)
        return why.value.reason


@pytest.fixture
def door() -> Door:
    return Door()


def test_what_is_signed_new_and_young_is_taken(door: Door) -> None:
    assert door.admission.admit(door.ask(1)) == Admitted(door.sender, ASKS)
    assert door.admission.admit(door.ask(7, MOST_AGE)) == Admitted(door.sender, ASKS)
    assert door.admission.admit(door.ask(8, -MOST_AHEAD)) == Admitted(door.sender, ASKS)
    assert not door.admission.refused


def test_each_refusal_is_counted_by_its_reason(door: Door) -> None:
    taken = door.ask(5)
    door.admission.admit(taken)
    answer = door.admission.signed(door.sender, b"{}")
    for datagram, reason in (
        (taken, "replayed"),
        (door.ask(5), "replayed"),
        (door.ask(4), "replayed"),
        (door.ask(6, MOST_AGE + 1), "stale"),
        (door.ask(6, -MOST_AHEAD - 1), "ahead"),
        (door.ask(6, key=OTHER), "forged"),
        (door.ask(6)[:-1], "forged"),
        (answer, "reflected"),
        (door.ask(6, receiver=UNKNOWN), "unacquainted"),
        (door.ask(6, receiver=new_name()), "unacquainted"),
        (ASKS, "malformed"),
        (b"", "malformed"),
        (door.ask(6) + bytes(door.admission.longest), "too long"),
    ):
        assert door.refused(datagram) == reason
    assert door.admission.refused == {
        "replayed": 3,
        "stale": 1,
        "ahead": 1,
        "forged": 2,
        "reflected": 1,
        "unacquainted": 2,
        "malformed": 2,
        "too long": 1,
    }
    assert door.admission.admit(door.ask(6)).sender == door.sender


def test_each_flipped_bit_is_noticed(door: Door) -> None:
    datagram = door.ask(1)
    for bit in range(8 * len(datagram)):
        flipped = bytearray(datagram)
        flipped[bit // 8] ^= 1 << bit % 8
        assert door.refused(bytes(flipped)) in {"forged", "malformed"}
    assert door.admission.admit(datagram).content == ASKS


@given(st.binary(max_size=300))
def test_nothing_at_random_is_admitted(datagram: bytes) -> None:
    Door().refused(datagram)


def test_a_stranger_learns_name_and_clock_by_a_signed_answer_to_its_counter(door: Door) -> None:
    with pytest.raises(NotAcquainted) as why:
        door.admission.admit(door.ask(3, receiver=UNKNOWN))
    answer = opened(KEY, "answer", why.value.answer)
    assert (answer.sender, answer.receiver) == (door.admission.name, door.sender)
    assert (answer.at, json.loads(answer.content)) == (door.clock(), {"answers": 3})


def test_what_was_recorded_is_refused_by_the_next_bridge(door: Door) -> None:
    recorded = door.ask(1)
    door.admission.admit(recorded)
    door.admission = Signed(KEY, door.clock)
    assert door.refused(recorded) == "unacquainted"


def test_senders_that_are_forgotten_cannot_be_repeated(door: Door) -> None:
    recorded = [door.ask(1, -MOST_AHEAD, sender=new_name()) for _ in range(MOST_SENDERS)]
    for datagram in recorded:
        door.admission.admit(datagram)
    assert door.refused(door.ask(1)) == "too many senders"
    door.clock.advance(MOST_AGE + MOST_AHEAD)
    assert door.refused(door.ask(1)) == "too many senders"
    assert {door.refused(datagram) for datagram in recorded} == {"replayed"}
    door.clock.advance(1)
    assert door.admission.admit(door.ask(1)).sender == door.sender
    assert {door.refused(datagram) for datagram in recorded} == {"stale"}


@given(st.lists(st.integers(1, 20), max_size=30))
def test_the_counters_of_what_is_taken_rise(counters: list[int]) -> None:
    door = Door()
    taken = []
    for counter in counters:
        try:
            door.admission.admit(door.ask(counter))
        except Refused:
            continue
        taken.append(counter)
    assert taken == sorted(set(taken))
    assert taken[-1:] == ([max(counters)] if counters else [])


# What its sender believes -------------------------------------------------------------------------


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
