"""Who watches what: counted by port, for a while, and not too many."""

import pytest

from firmware_runtime.links.local_socket import Connection
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.outgoing import MOST, WATCHED_FOR, Watcher, Watchers
from sim_doubles.clock import ManualClock


class Way(Connection):
    """The way to a watcher, by name; nothing listens."""

    def __init__(self, name: str) -> None:
        self.name = name

    def send(self, message: bytes) -> None:
        """Nothing listens."""


WAYS = {name: Way(name) for name in ("one", "two", "one more", *map(str, range(MOST)))}


@pytest.fixture
def now() -> ManualClock:
    return ManualClock()


@pytest.fixture
def watchers(now: ManualClock) -> Watchers:
    return Watchers(now)


def name_of(watcher: Watcher) -> str:
    assert isinstance(watcher.outlet, Way)
    return watcher.outlet.name


def received(watchers: Watchers, port: str, messages: int) -> list[int]:
    """The numbers of those messages that a watcher receives."""
    return [number for number in range(messages) if watchers.of(port)]


def test_every_watcher_receives_its_own_ports_each_so_many_messages(watchers: Watchers) -> None:
    watchers.renew(WAYS["one"], ["a"], 1)
    watchers.renew(WAYS["two"], ["a", "b"], 3)
    assert [[name_of(each) for each in watchers.of("a")] for _ in range(5)] == [
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
    watchers.renew(WAYS["one"], ["a"], 3)
    assert received(watchers, "a", 2) == [0]
    watchers.renew(WAYS["one"], ["a"], 3)
    assert received(watchers, "a", 2) == [1]
    watchers.renew(WAYS["one"], ["a"], 2)
    assert received(watchers, "a", 3) == [0, 2]


def test_a_new_wish_replaces_the_old_one(watchers: Watchers) -> None:
    watchers.renew(WAYS["one"], ["a"], 1)
    watchers.renew(WAYS["one"], ["b"], 1)
    assert watchers.ports == ("b",)
    watchers.renew(WAYS["one"], [], 1)
    assert not watchers.ports


def test_who_falls_silent_is_forgotten(watchers: Watchers, now: ManualClock) -> None:
    watchers.renew(WAYS["one"], ["a"], 1)
    now.advance(WATCHED_FOR // 2)
    watchers.renew(WAYS["two"], ["b"], 1)
    now.advance(WATCHED_FOR // 2 - 1)
    assert not watchers.forget_silent()
    now.advance(1)
    assert watchers.forget_silent()
    assert watchers.ports == ("b",)
    watchers.renew(WAYS["two"], ["b"], 1)
    now.advance(WATCHED_FOR // 2)
    assert not watchers.forget_silent()
    now.advance(WATCHED_FOR)
    assert watchers.forget_silent()
    assert not watchers.ports
    assert not watchers.forget_silent()


def test_there_is_room_for_so_many(watchers: Watchers) -> None:
    for number in range(MOST):
        watchers.renew(WAYS[str(number)], ["a"], 1)
    with pytest.raises(Refusal, match=f"{MOST} others watch already"):
        watchers.renew(WAYS["one more"], ["a"], 1)
    watchers.renew(WAYS["0"], ["b"], 1)
    watchers.forget(WAYS["1"])
    watchers.renew(WAYS["one more"], ["c"], 1)
    assert watchers.ports == ("b", "a", "c")
