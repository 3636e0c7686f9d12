"""Ports are tapped only while they are watched, and are then what they were before."""

from typing import Any

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.links.ports.outgoing import ROOM, Taps
from tests.support.devs_models import Clock, Log


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


@pytest.fixture
def line() -> Line:
    return Line()


@pytest.fixture
def simulator(line: Line) -> Simulator:
    return Simulator(line)


def received(taps: Taps) -> list[Any]:
    taken = list(taps.sent)
    taps.sent.clear()
    return taken


def test_what_is_open_is_tapped_and_nothing_else(line: Line, simulator: Simulator) -> None:
    taps = Taps(simulator)
    simulator.run(1)
    taps.open({"outlet": line.outlet})
    simulator.run(2)
    taps.open({})
    simulator.run(3)
    assert received(taps) == [("outlet", 2, 1)]
    assert line.log.bags == [[0], [1], [2]]


def test_a_port_that_is_watched_no_more_is_what_it_was(line: Line, simulator: Simulator) -> None:
    taps = Taps(simulator)
    taps.open({"outlet": line.outlet, "clock": line.clock.ticks})
    assert line.clock.ticks.listeners
    taps.open({})
    assert not line.clock.ticks.listeners


def test_ports_one_on_top_of_the_other_open_and_close_in_any_order(
    line: Line, simulator: Simulator
) -> None:
    inside, outside = {"clock": line.clock.ticks}, {"outlet": line.outlet}
    taps = Taps(simulator)
    for until, ports in enumerate((inside, inside | outside, outside, outside | inside), 1):
        taps.open(ports)
        simulator.run(until)
    assert received(taps) == [
        ("clock", 1, 0),
        ("clock", 2, 1),
        ("outlet", 2, 1),
        ("outlet", 3, 2),
        ("outlet", 4, 3),
        ("clock", 4, 3),
    ]


def test_who_listened_before_the_run_goes_on_listening(line: Line, simulator: Simulator) -> None:
    traced: list[int] = []
    simulator.listen(line.clock.ticks, lambda _at, value: traced.append(value))
    taps = Taps(simulator)
    taps.open({"clock": line.clock.ticks})
    simulator.run(1)
    taps.open({})
    simulator.run(2)
    assert traced == [0, 1]
    assert received(taps) == [("clock", 1, 0)]


def test_what_finds_no_room_makes_the_oldest_go(line: Line, simulator: Simulator) -> None:
    taps = Taps(simulator)
    taps.open({"clock": line.clock.ticks})
    simulator.run(ROOM + 3)
    assert taps.lost == 3
    assert [value for _, _, value in received(taps)] == list(range(3, ROOM + 3))
