"""What arrives where: bags, fan-out, ports, levels, and bags that share a pool."""

from dataclasses import dataclass
from math import inf, nan
from typing import Any, NamedTuple, TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.finite import check_of, takes
from firmware_runtime.devs.ports import InPort, OutPort, Takes
from firmware_runtime.devs.simulator import Simulator, pools
from tests.support.devs_models import Clock, Echo, Log, Scripted, top


def test_simultaneous_values_arrive_in_one_bag_in_order_of_the_senders() -> None:
    log = Log("log")
    clocks = [Clock("first", 10, 20), Clock("second", 20), Clock("third", 5, 5)]
    model = top(*clocks, log)
    for clock in reversed(clocks):
        model.couple(clock.ticks, log.values)
    Simulator(model).run(20)
    assert log.bags == [[0], [1], [2], [0, 0, 3]]


def test_values_sent_one_after_the_other_keep_their_order_and_the_bag_is_empty_after() -> None:
    sender, log = Scripted("sender", sigma=1), Log("log")

    def send() -> None:
        for value in (3, 1, 2):
            sender.outlet.send(value)

    sender.on_output = send
    model = top(sender, log)
    model.couple(sender.outlet, log.values)
    Simulator(model).run(1)
    assert log.bags == [[3, 1, 2]]
    clock, log = Clock("clock", 1), Log("log")
    model = top(clock, log)
    model.couple(clock.ticks, log.values)
    Simulator(model).run(3)
    assert list(log.values) == []
    assert log.bags == [[0], [1], [2]]


class TwoInlets(Atomic):
    """Keeps what each of its bags held at each transition."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.left = self.in_port("left", int)
        self.right = self.in_port("right", int)
        self.bags: list[tuple[list[int], list[int]]] = []

    def external(self, elapsed: int) -> None:
        self.continue_(elapsed)
        self.bags.append((list(self.left), list(self.right)))


def test_the_bags_of_a_model_with_several_ports_are_read_and_emptied_together() -> None:
    left, right, model = Clock("left", 2), Clock("right", 3), TwoInlets("model")
    root = top(left, right, model)
    root.couple(left.ticks, model.left)
    root.couple(right.ticks, model.right)
    simulator = Simulator(root)
    simulator.run(6)
    assert model.bags == [([0], []), ([], [0]), ([1], []), ([2], [1])]
    assert simulator.external_transitions == 4


def test_one_output_reaches_two_ports_of_a_model_in_one_transition() -> None:
    clock, model = Clock("clock", 1), TwoInlets("model")
    root = top(clock, model)
    root.couple(clock.ticks, model.right)
    root.couple(clock.ticks, model.left)
    Simulator(root).run(2)
    assert model.bags == [([0], [0]), ([1], [1])]


def test_a_value_that_comes_by_two_routes_comes_twice() -> None:
    inner, clock = Coupled("inner"), Clock("clock", 1)
    log = inner.add(Log("log"))
    model = top(clock, inner)
    for name in ("left", "right"):
        port = inner.in_port(name, int)
        inner.couple(port, log.values)
        model.couple(clock.ticks, port)
    simulator = Simulator(model)
    simulator.run(1)
    assert log.bags == [[0, 0]]
    assert simulator.external_transitions == 1


def test_a_model_reaches_itself_through_the_models_around_it() -> None:
    shell = Coupled("shell")
    model = shell.add(Scripted("model", sigma=5))
    model.on_output = lambda: model.outlet.send(1)
    inlet, outlet = shell.in_port("in", int), shell.out_port("out", int)
    shell.couple(inlet, model.inlet)
    shell.couple(model.outlet, outlet)
    root = top(shell)
    echo = root.add(Echo("echo"))
    root.couple(outlet, echo.inlet)
    root.couple(echo.outlet, inlet)
    Simulator(root).run(5)
    assert model.calls == [("internal", 0), ("external", 0)]


def nested(depth: int, echo: Echo) -> Coupled:
    """`echo` inside `depth` coupled models, its ports led through each of them."""
    model = Coupled(f"level_{depth}")
    inner = model.add(nested(depth - 1, echo)) if depth > 1 else model.add(echo)
    for name, port in inner.in_ports.items():
        model.couple(model.in_port(name, int), port)
    for name, output in inner.out_ports.items():
        model.couple(output, model.out_port(name, int))
    return model


def test_values_pass_through_many_levels_both_ways_at_one_instant() -> None:
    clock, log, echo = Clock("clock", 5), Log("log"), Echo("echo")
    shell = nested(50, echo)
    model = top(clock, shell, log)
    model.couple(clock.ticks, shell.in_ports["in"])
    model.couple(shell.out_ports["out"], log.values)
    simulator = Simulator(model)
    simulator.run(10)
    assert log.bags == [[0], [1]]
    assert simulator.atomics == (clock, echo, log)


A, B, C, D = (Log(name).values for name in "abcd")
Wires: TypeAlias = list[list[int]]
Bags: TypeAlias = tuple[InPort[Any], ...]


@pytest.mark.parametrize(
    ("feeds", "pools_"),
    [
        pytest.param([(A, B, C), (A, B, C)], [(A, B, C)], id="two ports that feed the same bags"),
        pytest.param([(A, B), (A, B)], [(A, B)], id="two ports that feed the same two"),
        pytest.param([(A, B), (C, D)], [], id="one port alone"),
        pytest.param([(A, B, C), (A, B, C), (B, C)], [(B, C)], id="those that the same ones feed"),
        pytest.param([(A, B), (A, B), (B, C), (B, C)], [], id="none that the same ones feed"),
        pytest.param([(A, B, C), (A, B, C), (B,)], [(A, C)], id="one fed by a port by itself"),
        pytest.param([(A, B, A, C, B), (A, B, A, C, B)], [], id="bags fed twice by a port"),
    ],
)
def test_bags_share_a_pool(feeds: list[Bags], pools_: list[Bags]) -> None:
    ports = [(OutPort(A.owner, f"out_{number}", int), [*each]) for number, each in enumerate(feeds)]
    assert [tuple(pool.bags) for pool in pools(ports, [])] == pools_


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
    simulator = Simulator(model)
    simulator.run(rounds)
    reached = {number for ends in wires for number in ends}
    assert simulator.external_transitions == rounds * len(reached), "each transits once a round"
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


class Measured(Struct):
    """A record with a number."""

    value: float


@dataclass
class Weighed:
    """Another, whose types are stated in words."""

    name: "str"
    weight: "float"


class Turned(NamedTuple):
    """A third one."""

    turns: int
    angle: float


class Bare(tuple[float, ...]):
    """A sequence that does not say of what."""

    __slots__ = ()


class Counted(Struct):
    """A record without a float."""

    name: str
    count: "int"


class Numbered(NamedTuple):
    """Another."""

    number: int
    name: str


@pytest.mark.parametrize(
    ("kind", "value", "is_taken"),
    [
        (tuple, (1.0, (2.0, nan)), False),
        (tuple, (1.0, Measured(nan)), False),
        (tuple, (1, "one", None, Measured(2.0)), True),
        (list, [1.0, [Measured(inf)]], False),
        (Measured, Measured(nan), False),
        (Measured, Measured(1.0), True),
        (Weighed, Weighed("one", inf), False),
        (Turned, Turned(1, nan), False),
        (Bare, Bare((1.0, nan)), False),
        (Numbered, Numbered(1, "one"), True),
        (complex, complex(0.0, nan), False),
        (float, 10**400, False),
        (float, "of another type, for the checked mode to find", True),
    ],
)
def test_a_number_that_is_not_finite_is_found_however_deep_it_is(
    kind: type[object], value: object, *, is_taken: bool
) -> None:
    assert takes(Coupled("top").in_port("in", kind), value) is is_taken


@pytest.mark.parametrize("kind", [int, bool, str, Counted, Numbered])
def test_what_holds_no_float_is_not_checked(kind: type[object]) -> None:
    assert check_of(Coupled("top").in_port("in", kind)) is None
