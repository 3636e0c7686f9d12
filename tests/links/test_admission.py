"""What a bridge with a key takes, and what not."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.links.bridge.admission import (
    MOST_AGE,
    MOST_AHEAD,
    MOST_SENDERS,
    Admitted,
    NotAcquainted,
    Signed,
)
from firmware_runtime.links.bridge.envelope import (
    UNKNOWN,
    Envelope,
    Refused,
    new_name,
    opened,
    sealed,
)
from sim_doubles.clock import ManualClock

KEY = bytes(range(32))
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
