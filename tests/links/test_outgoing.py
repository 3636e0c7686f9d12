"""What the ports of a run that are watched send: to whom, how often, for how long, and no more."""

import json
from typing import Any

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.links.local_socket import Connection
from firmware_runtime.links.ports.datagrams import WATCHED_FOR, Refusal, Watch
from firmware_runtime.links.ports.outgoing import MOST, ROOM, Outgoing
from firmware_runtime.links.ports.ports import Ports
from sim_doubles.clock import ManualClock
from tests.support.devs_models import Clock, Log
from tests.support.executives import Run


class Line(Coupled):
    """A coupled clock whose ticks leave by an output port, into a log."""

    def __init__(self) -> None:
        super().__init__("line")
        self.inner = self.add(Coupled("inner"))
        self.clock = self.inner.add(Clock("clock", period=1))
        self.outlet = self.inner.out_port("outlet", int)
        self.inner.couple(self.clock.ticks, self.outlet)
        self.log = self.add(Log("log"))
        self.couple(self.outlet, self.log.values)


TICKS, OUTLET = "inner.clock.ticks", "inner.outlet"


class Reader(Connection):
    """One that watches; what it was sent is kept."""

    def __init__(self) -> None:
        self.said: list[Any] = []

    def send(self, message: bytes) -> None:
        self.said.append(json.loads(message))

    def taken(self) -> list[tuple[str, int, int]]:
        """Port, instant and value of what came since the last call."""
        said, self.said = self.said, []
        return [(each["port"], each["t_ns"], each["value"]) for each in said if "port" in each]


class Rig:
    """A line whose clock ticks each ns, and readers of its ports; `now` is the readers' clock."""

    def __init__(self) -> None:
        self.line = Line()
        self.now = ManualClock()
        executive = Run(self.line, VirtualClock()).executive
        self.simulator = executive.simulator
        self.outgoing = Outgoing(executive, Ports(self.line), self.now)

    def watch(self, reader: Reader, *ports: str, every: int = 1) -> None:
        self.outgoing.watch(reader, Watch(ports, every))

    def run(self, ticks: int) -> None:
        """Let so many more ticks leave, each sent on as it comes."""
        for _ in range(ticks):
            self.simulator.run(self.simulator.now + 1)
            self.outgoing.between_steps(0, SECOND)


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_every_reader_gets_its_own_ports_each_so_many_messages(rig: Rig) -> None:
    one, two = Reader(), Reader()
    rig.watch(one, OUTLET)
    rig.watch(two, OUTLET, TICKS, every=3)
    rig.run(5)
    assert one.taken() == [(OUTLET, at, at - 1) for at in range(1, 6)]
    assert sorted(two.taken()) == [(TICKS, 1, 0), (TICKS, 4, 3), (OUTLET, 1, 0), (OUTLET, 4, 3)]
    assert rig.line.log.bags == [[number] for number in range(5)], "which go on as they were"


def test_renewing_goes_on_counting_unless_something_else_is_asked_for(rig: Rig) -> None:
    reader = Reader()
    found = []
    for every, ticks in ((3, 2), (3, 2), (2, 3)):
        rig.watch(reader, OUTLET, every=every)
        rig.run(ticks)
        found.append([value for _, _, value in reader.taken()])
    assert found == [[0], [3], [4, 6]]


def test_only_what_is_watched_is_listened_to_in_whatever_order_that_changes(rig: Rig) -> None:
    reader = Reader()
    for ports in ([TICKS], [TICKS, OUTLET], [OUTLET], [OUTLET, TICKS], []):
        rig.watch(reader, *ports)
        rig.run(1)
        assert sorted(port for port, _, _ in reader.taken()) == sorted(ports)
        assert len(rig.line.clock.ticks.listeners) == len(ports)


def test_who_listened_before_the_run_goes_on_listening(rig: Rig) -> None:
    traced: list[int] = []
    rig.simulator.listen(rig.line.clock.ticks, lambda _at, value: traced.append(value))
    reader = Reader()
    rig.watch(reader, TICKS)
    rig.run(1)
    rig.watch(reader)
    rig.run(1)
    assert (traced, reader.taken()) == ([0, 1], [(TICKS, 1, 0)])


def test_what_finds_no_room_makes_the_oldest_go(rig: Rig) -> None:
    reader = Reader()
    rig.watch(reader, TICKS)
    rig.simulator.run(ROOM + 3)
    rig.outgoing.between_steps(0, SECOND)
    assert rig.outgoing.dropped == 3
    assert [value for _, _, value in reader.taken()] == list(range(3, ROOM + 3))


def test_who_falls_silent_is_forgotten(rig: Rig) -> None:
    one, two = Reader(), Reader()
    rig.watch(one, TICKS)
    rig.now.advance(WATCHED_FOR // 2)
    rig.watch(two, OUTLET)
    for wait, who_gets in ((WATCHED_FOR // 2 - 1, [1, 1]), (1, [0, 1]), (WATCHED_FOR // 2, [0, 0])):
        rig.now.advance(wait)
        rig.run(1)
        assert [len(one.taken()), len(two.taken())] == who_gets
    assert not rig.line.clock.ticks.listeners


def test_there_is_room_for_so_many(rig: Rig) -> None:
    readers = [Reader() for _ in range(MOST)]
    for reader in readers:
        rig.watch(reader, TICKS)
    late = Reader()
    with pytest.raises(Refusal, match=f"{MOST} others watch already"):
        rig.watch(late, TICKS)
    rig.watch(readers[0], OUTLET)
    rig.outgoing.forget(readers[1])
    rig.watch(late, TICKS)
    rig.run(1)
    assert [len(each.taken()) for each in (*readers[:3], late)] == [1, 0, 1, 1]
