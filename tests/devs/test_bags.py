"""What arrives where: bags, fan-out, ports, and the levels that values pass through."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from tests.support.devs_models import Clock, Echo, Log, Scripted, top


def test_simultaneous_values_arrive_in_one_bag_in_order_of_the_senders() -> None:
    log = Log("log")
    clocks = [Clock("first", 10, 20), Clock("second", 20), Clock("third", 5, 5)]
    model = top(*clocks, log)
    for clock in reversed(clocks):
        model.couple(clock.ticks, log.values)
    Simulator(model).run(20)
    assert log.bags == [[0], [1], [2], [0, 0, 3]]


def test_values_sent_one_after_the_other_keep_their_order() -> None:
    sender, log = Scripted("sender", sigma=1), Log("log")

    def send() -> None:
        for value in (3, 1, 2):
            sender.outlet.send(value)

    sender.on_output = send
    model = top(sender, log)
    model.couple(sender.outlet, log.values)
    Simulator(model).run(1)
    assert log.bags == [[3, 1, 2]]


def test_the_bag_is_empty_again_after_the_transition() -> None:
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


def test_several_senders_that_feed_the_same_ports_fill_every_bag_in_order() -> None:
    clocks = [Clock("a", 1), Clock("b", 2), Clock("c", 1)]
    logs = [Log("x"), Log("y")]
    model = top(*clocks, *logs)
    for clock in clocks:
        for log in logs:
            model.couple(clock.ticks, log.values)
    simulator = Simulator(model)
    simulator.run(2)
    assert [log.bags for log in logs] == [[[0, 0], [1, 0, 1]]] * 2
    assert simulator.external_transitions == 4


def test_a_model_reached_by_overlapping_groups_of_wires_transits_once() -> None:
    clocks, logs = [Clock("a", 1), Clock("b", 1)], [Log("x"), Log("y"), Log("z")]
    model = top(*clocks, *logs)
    for clock, ends in zip(clocks, (logs[:2], logs[1:]), strict=True):
        for log in ends:
            model.couple(clock.ticks, log.values)
    simulator = Simulator(model)
    simulator.run(1)
    assert [log.bags for log in logs] == [[[0]], [[0, 0]], [[0]]]
    assert simulator.external_transitions == 3


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
