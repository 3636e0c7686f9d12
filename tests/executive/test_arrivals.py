from collections.abc import Sequence

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.inbox import CAPACITY, Arrivals, Inbox
from sim_doubles.clock import ManualClock
from tests.support.periodic_models import Robot


class Burst:
    """A source that has `size` values whenever it is asked."""

    def __init__(self, port: InPort[int], size: int) -> None:
        self.port = port
        self.size = size

    def fileno(self) -> int:
        return -1  # there is no wait for it here

    def receive(self) -> Sequence[tuple[InPort[int], object]]:
        return [(self.port, number) for number in range(self.size)]


def test_nothing_has_arrived_at_first() -> None:
    inbox = Inbox(ManualClock())
    arrivals = Arrivals(inbox, [])
    assert arrivals.next_at(5) == NEVER
    assert list(arrivals.take(NEVER)) == []
    assert arrivals.sources(waits=True) == [inbox]


def test_an_inbox_is_asked_only_when_it_was_woken_where_nothing_waits() -> None:
    inbox, robot = Inbox(ManualClock()), Robot()
    arrivals = Arrivals(inbox, [])
    assert arrivals.sources(waits=False) == []
    inbox.post(robot.command, 1)
    assert arrivals.sources(waits=False) == [inbox]
    arrivals.receive([inbox], now=0)
    assert arrivals.sources(waits=False) == []
    inbox.wake()
    assert arrivals.sources(waits=False) == [inbox]


def test_a_source_beside_the_inbox_is_always_asked() -> None:
    burst = Burst(Robot().command, CAPACITY)
    arrivals = Arrivals(Inbox(ManualClock()), [burst])
    assert burst in arrivals.sources(waits=False)
    arrivals.receive([burst], now=1)
    assert arrivals.sources(waits=False) == []


def test_what_a_source_gives_at_once_shares_the_instant_of_reading() -> None:
    robot = Robot()
    arrivals = Arrivals(Inbox(ManualClock()), [])
    arrivals.receive([Burst(robot.command, 2)], now=30)
    arrivals.receive([Burst(robot.replan, 1)], now=40)
    assert arrivals.next_at(0) == 30
    assert list(arrivals.take(39)) == [(robot.command, 0), (robot.command, 1)]
    assert arrivals.next_at(0) == 40


def test_a_value_is_never_handled_before_what_has_already_happened() -> None:
    arrivals = Arrivals(Inbox(ManualClock()), [])
    arrivals.receive([Burst(Robot().command, 1)], now=30)
    assert arrivals.next_at(35) == 35


def test_sources_are_not_read_while_too_much_waits() -> None:
    burst = Burst(Robot().command, CAPACITY)
    arrivals = Arrivals(Inbox(ManualClock()), [burst])
    arrivals.receive([burst], now=1)
    assert arrivals.sources(waits=True) == []
    assert len(list(arrivals.take(1))) == CAPACITY
    assert burst in arrivals.sources(waits=True)
