"""Who watches what: counted by port, for a while, and not too many."""

import pytest

from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.watchers import MOST, WATCHED_FOR, Address, Watchers
from sim_doubles.clock import ManualClock


class Way:
    """To nowhere; `closed` has who is not led to any more."""

    closed: list[Address]

    def __init__(self, address: Address) -> None:
        if address == "connected":
            raise PermissionError(1, "Operation not permitted")
        self._address = address

    def send(self, message: bytes) -> None:
        """Nothing listens."""

    def close(self) -> None:
        self.closed.append(self._address)


@pytest.fixture
def now() -> ManualClock:
    return ManualClock()


@pytest.fixture
def watchers(now: ManualClock) -> Watchers:
    Way.closed = []
    return Watchers(now, Way)


def received(watchers: Watchers, port: str, messages: int) -> list[int]:
    """The numbers of those messages that a watcher receives."""
    return [number for number in range(messages) if watchers.of(port)]


def test_every_watcher_receives_its_own_ports_each_so_many_messages(watchers: Watchers) -> None:
    watchers.renew("one", ["a"], 1)
    watchers.renew("two", ["a", "b"], 3)
    assert [[each.address for each in watchers.of("a")] for _ in range(5)] == [
        ["one", "two"],
        ["one"],
        ["one"],
        ["one", "two"],
        ["one"],
    ]
    assert received(watchers, "b", 7) == [0, 3, 6]
    assert watchers.of("c") == []
    assert watchers.ports == ("a", "b")


def test_renewing_goes_on_counting_unless_something_else_is_asked_for(watchers: Watchers) -> None:
    watchers.renew("one", ["a"], 3)
    assert received(watchers, "a", 2) == [0]
    watchers.renew("one", ["a"], 3)
    assert received(watchers, "a", 2) == [1]
    watchers.renew("one", ["a"], 2)
    assert received(watchers, "a", 3) == [0, 2]


def test_a_new_wish_replaces_the_old_one(watchers: Watchers) -> None:
    watchers.renew("one", ["a"], 1)
    watchers.renew("one", ["b"], 1)
    assert watchers.ports == ("b",)
    assert Way.closed == []
    watchers.renew("one", [], 1)
    assert len(watchers) == 0
    assert Way.closed == ["one"]


def test_who_falls_silent_is_forgotten(watchers: Watchers, now: ManualClock) -> None:
    watchers.renew("one", ["a"], 1)
    now.advance(WATCHED_FOR // 2)
    watchers.renew("two", ["b"], 1)
    now.advance(WATCHED_FOR // 2 - 1)
    assert not watchers.forget_silent()
    now.advance(1)
    assert watchers.forget_silent()
    assert Way.closed == ["one"]
    assert watchers.ports == ("b",)
    watchers.renew("two", ["b"], 1)
    now.advance(WATCHED_FOR // 2)
    assert not watchers.forget_silent()
    now.advance(WATCHED_FOR)
    assert watchers.forget_silent()
    assert len(watchers) == 0
    assert not watchers.forget_silent()


def test_there_is_room_for_so_many(watchers: Watchers) -> None:
    for number in range(MOST):
        watchers.renew(str(number), ["a"], 1)
    with pytest.raises(Refusal, match=f"{MOST} others watch already"):
        watchers.renew("one more", ["a"], 1)
    watchers.renew("0", ["b"], 1)
    watchers.forget("1")
    watchers.renew("one more", ["c"], 1)
    assert watchers.ports == ("b", "a", "c")


def test_a_sender_that_cannot_be_answered_is_not_taken_in(watchers: Watchers) -> None:
    with pytest.raises(Refusal, match="expected a socket that is not connected"):
        watchers.renew("connected", ["a"], 1)
    assert len(watchers) == 0


def test_in_the_end_no_process_is_led_to(watchers: Watchers) -> None:
    for address in ("one", "two"):
        watchers.renew(address, ["a"], 1)
    watchers.close()
    assert Way.closed == ["one", "two"]
    assert watchers.ports == ()
