"""Bags fed by the same ports share a pool, and get what each of them would have got alone."""

from math import inf, nan
from typing import Any, TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import InPort, OutPort, Takes
from firmware_runtime.devs.simulator import Simulator, pools
from tests.support.devs_models import Clock, Log, top

A, B, C, D = (Log(name).values for name in "abcd")
Wires: TypeAlias = list[list[int]]
Bags: TypeAlias = tuple[InPort[Any], ...]


def shared(*feeds: Bags) -> list[Bags]:
    """The bags of each pool, given the bags that each port feeds."""
    ports = [(OutPort(A.owner, f"out_{number}", int), [*each]) for number, each in enumerate(feeds)]
    return [tuple(pool.bags) for pool in pools(ports, [])]


def test_two_ports_that_feed_the_same_bags_give_these_a_pool() -> None:
    assert shared((A, B, C), (A, B, C)) == [(A, B, C)]


def test_one_port_alone_feeds_its_bags_without_a_pool() -> None:
    assert shared((A, B), (C, D)) == []


def test_bags_that_other_ports_feed_too_share_with_those_that_the_same_ones_feed() -> None:
    assert shared((A, B, C), (A, B, C), (B, C)) == [(B, C)]
    assert shared((A, B), (A, B), (B, C), (B, C)) == []


def test_a_bag_that_a_port_feeds_by_itself_shares_with_no_other() -> None:
    assert shared((A, B, C), (A, B, C), (B,)) == [(A, C)]


def test_a_bag_fed_twice_by_a_port_shares_with_none() -> None:
    assert shared((A, B, A, C, B), (A, B, A, C, B)) == []


WIRES = st.lists(
    st.sampled_from([[], [0], [1], [0, 1], [1, 2], [0, 1, 2], [2, 1, 0], [0, 1, 2, 3]]),
    min_size=1,
    max_size=6,
)


@given(wires=WIRES, rounds=st.integers(1, 3))
def test_every_bag_gets_what_was_sent_to_it_in_order_whoever_shares(
    wires: Wires, rounds: int
) -> None:
    senders = [Clock(f"sender_{number}", 1, offset=1) for number in range(len(wires))]
    logs = [Log(f"log_{number}") for number in range(4)]
    model = top(*senders, *logs)
    for first, (sender, ends) in enumerate(zip(senders, wires, strict=True)):
        sender.count = 100 * first
        for end in ends:
            model.couple(sender.ticks, logs[end].values)
    Simulator(model).run(rounds)
    for number, log in enumerate(logs):
        received = [100 * first for first, ends in enumerate(wires) if number in ends]
        expected = [[value + tick for value in received] for tick in range(rounds)]
        assert log.bags == (expected if received else [])


class Meeting(Log):
    """A log whose time runs out with each bag."""

    def initialize(self) -> None:
        self.hold_in("waiting", 5)

    def internal(self) -> None:
        self.hold_in("waiting", 5)


def test_shared_bags_fill_for_confluent_transitions_and_are_empty_after() -> None:
    clocks, logs = [Clock("a", 5), Clock("b", 5)], [Meeting("x"), Meeting("y")]
    model = top(*logs, *clocks)
    for clock in clocks:
        for log in logs:
            model.couple(clock.ticks, log.values)
    simulator = Simulator(model)
    simulator.run(10)
    assert [(log.bags, log.elapsed) for log in logs] == [([[0, 0], [1, 1]], [0, 0])] * 2
    assert (simulator.internal_transitions, simulator.external_transitions) == (8, 4)
    assert [list(log.values) for log in logs] == [[], []]


def test_injected_values_and_sent_ones_meet_in_a_shared_bag() -> None:
    clock, logs = Clock("clock", 5), [Log("x"), Log("y")]
    model = top(clock, *logs)
    inlet = model.in_port("in", int)
    for log in logs:
        model.couple(inlet, log.values)
        model.couple(clock.ticks, log.values)
    simulator = Simulator(model)
    simulator.run(4)
    for value in (7, 8):
        simulator.inject(inlet, value)
    simulator.advance(5)
    assert [log.bags for log in logs] == [[[7, 8, 0]]] * 2


class Sender(Atomic):
    """Sends its values at 1 ns."""

    def __init__(self, name: str, *values: float) -> None:
        super().__init__(name)
        self.values = values
        self.outlet = self.out_port("out", float)

    def initialize(self) -> None:
        self.hold_in("waiting", 1)

    def output(self) -> None:
        for value in self.values:
            self.outlet.send(value)

    def internal(self) -> None:
        self.passivate()


class Taker(Atomic):
    """Keeps what it gets."""

    def __init__(self, name: str, takes: Takes) -> None:
        super().__init__(name)
        self.got: list[float] = []
        self.inlet = self.in_port("in", float, takes=takes)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- of no use here
        self.got += self.inlet


@pytest.mark.parametrize("simulator", [Simulator, ClassicSimulator])
@pytest.mark.parametrize("others", ["finite", "infinities", "any"])
def test_each_of_several_bags_is_kept_from_what_it_does_not_take(
    simulator: type[Engine], others: Takes
) -> None:
    senders = [Sender("a", 1.0, nan), Sender("b", inf, 2.0)]
    takers = [Taker("x", "finite"), Taker("y", "finite"), Taker("z", others)]
    model = top(*senders, *takers)
    for sender in senders:
        for taker in takers:
            model.couple(sender.outlet, taker.inlet)
    run = simulator(model)
    refused: list[tuple[str, str]] = []
    run.on_refused = lambda port, value: refused.append((port.owner.name, repr(value)))
    run.run(1)
    missed = {"finite": ["nan", "inf"], "infinities": ["nan"], "any": []}
    expected = [(name, each) for name in "xy" for each in ("nan", "inf")]
    assert sorted(refused) == sorted(expected + [("z", each) for each in missed[others]])
    got = {"finite": "[1.0, 2.0]", "infinities": "[1.0, inf, 2.0]", "any": "[1.0, nan, inf, 2.0]"}
    assert [repr(each.got) for each in takers] == [got["finite"], got["finite"], got[others]]
