"""Traces, trees, senders and recorded ports of a model; the page on the kernel."""

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import Sent
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.trace import trace
from firmware_runtime.devs.tree import tree
from tests.support.devs_models import Clock, Echo, Log, top, traced
from tests.support.pages import examples, printed
from tests.support.periodic_models import PERIOD, Robot


def test_a_trace_has_every_message_with_instant_and_path_below_the_root() -> None:
    controller = Coupled("controller")
    yaw, clock = controller.add(Echo("yaw", delay=1)), Clock("imu", 5)
    inlet = controller.in_port("in", int)
    controller.couple(inlet, yaw.inlet)
    model = top(clock, controller)
    model.couple(clock.ticks, inlet)
    assert traced(Simulator(model), 10) == [
        (5, "imu.ticks", 0),
        (6, "controller.yaw.out", 0),
        (10, "imu.ticks", 1),
    ]
    assert traced(Simulator(Clock("clock", 5)), 5) == [(5, "ticks", 0)], "coupled to none"


def test_only_the_ports_named_are_traced_in_the_order_of_their_messages() -> None:
    inner = Coupled("inner")
    clock, other = inner.add(Clock("clock", 5)), inner.add(Clock("other", 5))
    outlet = inner.out_port("out", int)
    inner.couple(clock.ticks, outlet)
    simulator = Simulator(top(inner))
    messages: list[tuple[int, str, object]] = []
    trace(simulator, lambda *message: messages.append(message), [other.ticks, outlet])
    simulator.run(5)
    assert messages == [(5, "inner.out", 0), (5, "inner.other.ticks", 0)]


def test_an_untraced_run_has_nothing_between_sender_and_bag() -> None:
    clock, log = Clock("clock", 5), Log("log")
    model = top(clock, log)
    model.couple(clock.ticks, log.values)
    simulator = Simulator(model, checked=False)
    assert clock.ticks._only is log.values
    trace(simulator, lambda _at, _path, _value: None)
    assert clock.ticks._only is None


def example() -> Coupled:
    robot, controller = Coupled("robot"), Coupled("controller")
    clock, log = robot.add(Clock("clock", 5)), robot.add(Log("log"))
    robot.add(controller)
    echo = controller.add(Echo("echo"))
    inlet, outlet = controller.in_port("in", int), controller.out_port("out", int)
    controller.couple(inlet, echo.inlet)
    controller.couple(echo.outlet, outlet)
    robot.couple(clock.ticks, inlet)
    robot.couple(outlet, log.values)
    return robot


def test_a_tree_shows_components_ports_with_types_and_couplings_in_order_of_declaration() -> None:
    assert tree(example()) == (
        "robot (Coupled)\n"
        "  clock (Clock)\n"
        "    ticks: int ->\n"
        "  log (Log)\n"
        "    -> values: int\n"
        "  controller (Coupled)\n"
        "    -> in: int\n"
        "    out: int ->\n"
        "    echo (Echo)\n"
        "      -> in: int\n"
        "      out: int ->\n"
        "    in -> echo.in\n"
        "    echo.out -> out\n"
        "  clock.ticks -> controller.in\n"
        "  controller.out -> log.values"
    )
    lines = tree(example(), couplings=False).splitlines()
    assert "  clock.ticks -> controller.in" not in lines
    assert "      out: int ->" in lines
    first, *_, last = tree(example().components["controller"]).splitlines()
    assert (first, last) == ("controller (Coupled)", "  echo.out -> out")


class Unfinished(Atomic):
    def __init__(self) -> None:
        """Call nothing of the class above."""


@pytest.mark.parametrize("root", [Unfinished(), "robot"])
def test_what_is_no_model_has_no_tree(root: Atomic) -> None:
    with pytest.raises(CouplingError, match="expected"):
        tree(root)


class Source(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.out = self.out_port("out", int)


class Box(Coupled):
    """One source, or several, behind one port; the input passes through to a port of its own."""

    def __init__(self, name: str, *inner: Source | Coupled) -> None:
        super().__init__(name)
        self.out = self.out_port("out", int)
        self.unused = self.out_port("unused", int)
        self.given = self.in_port("given", int)
        self.passed = self.out_port("passed", int)
        self.couple(self.given, self.passed)
        for each in inner:
            self.add(each)
            self.couple(each.out_ports["out"], self.out)


@pytest.fixture
def senders() -> Senders:
    root = Coupled("root")
    root.add(Box("outer", Box("inner", Source("deep"))))
    root.add(Box("pair", Source("left"), Source("right")))
    return Senders(root)


def test_a_port_s_values_go_by_the_atomic_that_sends_them(senders: Senders) -> None:
    assert senders.of("outer.inner.deep.out") == ("outer.inner.deep.out",)
    assert senders.of("outer.inner.out") == senders.of("outer.out") == ("outer.inner.deep.out",)
    assert senders.of("pair.out") == ("pair.left.out", "pair.right.out")
    assert senders.carry("outer.out", "outer.inner.deep.out")
    assert senders.carry("outer.inner.deep.out", "outer.out")
    assert senders.carry("pair.out", "pair.left.out")
    assert not senders.carry("pair.left.out", "pair.out")
    assert not senders.carry("outer.out", "pair.left.out")


@pytest.mark.parametrize("path", ["outer.unused", "outer.passed", "world.place", "", "root.x"])
def test_a_port_that_nothing_in_the_model_sends_through_goes_by_its_own_name(
    senders: Senders, path: str
) -> None:
    assert senders.of(path) == (path,)


def tapped() -> tuple[Robot, Simulator, Sent]:
    """A robot of whose models the one sends to another, and the other to none."""
    robot, sent = Robot(compass=PERIOD), Sent()
    simulator = Simulator(robot)
    assert not robot.compass.sample.leads_somewhere
    robot.imu.sample.record(7, sent)
    robot.compass.sample.record(9, sent)
    assert robot.compass.sample.leads_somewhere
    return robot, simulator, sent


def test_values_are_noted_as_they_left_and_listeners_get_them_as_before() -> None:
    robot, simulator, sent = tapped()
    simulator.run(PERIOD)
    assert sent == [7, 0, 9, 0, 7, 1, 9, 1]
    assert robot.thrust.received == [0, 1]
    robot, simulator, sent = tapped()
    received: list[int] = []
    listening = simulator.listen(robot.compass.sample, lambda _at, value: received.append(value))
    simulator.run(0)
    listening.end()
    simulator.run(PERIOD)
    assert received == [0]
    assert sent[2::4] == [9, 9]


def test_the_example_prints_what_the_page_says() -> None:
    (example,) = examples("kernel.md")
    assert printed(example.program) == example.output
