"""What happens at an instant, and in which order."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from tests.support.devs_models import Clock, Echo, Log, Scripted, top, traced


def test_a_clock_ticks_at_exact_multiples_of_its_period() -> None:
    model = top(Clock("clock", 10 * MILLISECOND))
    messages = traced(Simulator(model), 10 * MILLISECOND * 1000)
    assert [(at, value) for at, _, value in messages] == [
        (10 * MILLISECOND * (count + 1), count) for count in range(1000)
    ]


def test_an_atomic_model_runs_as_the_root() -> None:
    assert traced(Simulator(Clock("clock", 3)), 7) == [(3, "ticks", 0), (6, "ticks", 1)]


def test_an_atomic_root_takes_injected_input() -> None:
    echo = Echo("echo", delay=2)
    simulator = Simulator(echo)
    simulator.inject(echo.inlet, 7)
    assert traced(simulator, 10) == [(2, "out", 7)]


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


def test_elapsed_counts_from_the_last_transition_of_any_kind() -> None:
    clock, model = Clock("clock", 4), Scripted("model")
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    holds = iter([6, 3, NEVER])
    model.on_external = lambda _elapsed: model.hold_in("holding", next(holds))
    Simulator(root).run(12)  # inputs at 4, 8 and 12; internal at 8 + 3
    assert model.calls == [("external", 4), ("external", 4), ("internal", 0), ("external", 1)]


def test_continuing_keeps_the_planned_instant() -> None:
    clock, model = Clock("clock", 3), Scripted("model", sigma=10)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    simulator = Simulator(root)
    simulator.run(9)
    assert [name for name, _ in model.calls] == ["external"] * 3
    assert simulator.due_at(model) == 10


def collision(model: Scripted) -> Simulator:
    """`model` is due at the instant at which it gets an input, 5."""
    clock = Clock("clock", 5)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    simulator = Simulator(root)
    simulator.run(5)
    return simulator


def test_by_default_confluent_is_internal_then_external_with_nothing_elapsed() -> None:
    model = Scripted("model", sigma=5)
    model.on_internal = lambda: model.hold_in("again", 7)
    simulator = collision(model)
    assert model.calls == [("internal", 0), ("external", 0)]
    assert simulator.due_at(model) == 12
    assert (simulator.internal_transitions, simulator.external_transitions) == (2, 1)


class InputFirst(Scripted):
    """Takes the input first; the bag is there in its confluent function."""

    def confluent(self) -> None:
        self.calls.append(("confluent", len(self.inlet)))
        self.external(self.sigma)
        self.internal()


def test_a_model_may_have_its_own_confluent_function() -> None:
    model = InputFirst("model", sigma=5)
    simulator = collision(model)
    assert model.calls == [("confluent", 1), ("external", 5), ("internal", 0)]
    assert list(model.inlet) == []
    assert simulator.due_at(model) == NEVER


def test_all_outputs_of_a_round_come_before_its_transitions_in_order_of_declaration() -> None:
    order: list[str] = []

    def note(model: Scripted) -> Scripted:
        def transit() -> None:
            order.append(f"{model.name} transits")
            model.passivate()

        model.on_output = lambda: order.append(f"{model.name} sends")
        model.on_internal = transit
        return model

    b, a = note(Scripted("b", sigma=1)), note(Scripted("a", sigma=1))
    Simulator(top(b, a)).run(1)
    assert order == ["b sends", "a sends", "b transits", "a transits"]


def test_receivers_transit_in_order_of_declaration_whatever_the_order_of_the_wires() -> None:
    order: list[str] = []
    clock, models = Clock("clock", 1), [Scripted(name) for name in "cab"]
    root = top(clock, *models)
    for model in reversed(models):
        root.couple(clock.ticks, model.inlet)
        model.on_external = lambda _elapsed, name=model.name: order.append(name)  # type: ignore[misc]
    Simulator(root).run(1)
    assert order == ["c", "a", "b"]


def test_those_that_follow_at_once_send_in_order_of_declaration_too() -> None:
    clock, woken = Clock("clock", 5), Echo("woken")
    eager = Scripted("eager", sigma=5)
    eager.on_output = lambda: eager.outlet.send(len(eager.calls))
    eager.on_internal = lambda: eager.hold_in("", 0 if len(eager.calls) < 2 else NEVER)
    root = top(woken, eager, clock)
    root.couple(clock.ticks, woken.inlet)
    assert [path for _, path, _ in traced(Simulator(root), 5)] == [
        "eager.out",
        "clock.ticks",
        "woken.out",
        "eager.out",
    ]


def test_one_value_may_meet_an_imminent_and_a_waiting_model() -> None:
    clock, due, waiting = Clock("clock", 5), Scripted("due", sigma=5), Scripted("waiting")
    root = top(waiting, due, clock)
    for model in (due, waiting):
        root.couple(clock.ticks, model.inlet)
    simulator = Simulator(root)
    simulator.run(5)
    assert due.calls == [("internal", 0), ("external", 0)]
    assert waiting.calls == [("external", 5)]
    assert (simulator.internal_transitions, simulator.external_transitions) == (2, 2)


def test_zero_time_rounds_follow_each_other_at_one_instant() -> None:
    clock, log = Clock("clock", 5), Log("log")
    echoes = [Echo(f"echo_{index}") for index in range(3)]
    model = top(log, *reversed(echoes), clock)
    model.couple(clock.ticks, echoes[0].inlet)
    model.couple(echoes[0].outlet, echoes[1].inlet)
    model.couple(echoes[1].outlet, echoes[2].inlet)
    model.couple(echoes[2].outlet, log.values)
    assert traced(Simulator(model), 5) == [
        (5, "clock.ticks", 0),
        (5, "echo_0.out", 0),
        (5, "echo_1.out", 0),
        (5, "echo_2.out", 0),
    ]
    assert (log.bags, log.elapsed) == ([[0]], [5])


def test_a_model_that_was_booked_later_and_becomes_imminent_now_is_not_activated_twice() -> None:
    clock, model = Clock("clock", 5), Scripted("model", sigma=8)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    model.on_external = lambda _elapsed: model.activate()
    Simulator(root).run(9)
    assert model.calls == [("external", 5), ("internal", 0)]


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


def test_a_model_hears_itself_through_the_models_around_it() -> None:
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


class Table(Atomic):
    """Computes its time advance from its state: 3, 1, 4, 1, 5 ns, then never."""

    TIMES = (3, 1, 4, 1, 5, NEVER)

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.step = 0
        self.inlet = self.in_port("in", int)
        self.outlet = self.out_port("out", int)

    def time_advance(self) -> int:
        return self.TIMES[self.step]

    def output(self) -> None:
        self.outlet.send(self.step)

    def internal(self) -> None:
        self.step += 1

    def external(self, elapsed: int) -> None:
        self.step = elapsed


def test_a_model_may_compute_its_time_advance() -> None:
    messages = traced(Simulator(Table("table")), 100)
    assert [(at, value) for at, _, value in messages] == [(3, 0), (4, 1), (8, 2), (9, 3), (14, 4)]


def test_a_computed_time_advance_is_asked_for_after_every_kind_of_transition() -> None:
    table = Table("table")
    simulator = Simulator(table)
    simulator.inject(table.inlet, 0)
    simulator.advance(2)
    assert (table.step, simulator.next_at) == (2, 6)
    simulator.inject(table.inlet, 0)
    simulator.advance(6)
    assert (table.step, simulator.next_at) == (0, 9)


class TableWithConfluent(Table):
    """Starts again where two events meet."""

    def confluent(self) -> None:
        self.step = 4


def test_a_computed_time_advance_is_asked_for_after_an_own_confluent_function() -> None:
    table = TableWithConfluent("table")
    simulator = Simulator(table)
    simulator.inject(table.inlet, 0)
    simulator.advance(3)
    assert (table.step, simulator.next_at) == (4, 8)


def test_initial_conditions_hold_before_anything_runs() -> None:
    clock, idle = Clock("clock", 5, offset=0), Log("idle")
    simulator = Simulator(top(clock, idle))
    assert (simulator.now, simulator.next_at) == (0, 0)
    assert (simulator.due_at(clock), simulator.due_at(idle)) == (0, NEVER)
    assert (clock.phase, idle.phase) == ("ticking", "passive")
    assert (simulator.internal_transitions, simulator.external_transitions) == (0, 0)


def test_a_run_that_starts_at_zero_does_not_lose_its_first_instant() -> None:
    assert traced(Simulator(top(Clock("clock", 5, offset=0))), 5) == [
        (0, "clock.ticks", 0),
        (5, "clock.ticks", 1),
    ]


def test_a_model_of_passive_models_ends_at_once() -> None:
    simulator = Simulator(top(Log("log")))
    simulator.run(NEVER)
    assert (simulator.now, simulator.next_at) == (0, NEVER)


def test_an_atomic_model_alone_is_state_in_and_state_out() -> None:
    echo = Echo("echo", delay=5)
    echo.inlet.extend([1, 2])
    echo.external(0)
    assert (echo.held, echo.phase, echo.sigma) == ([1, 2], "holding", 5)
    echo.external(3)
    assert (echo.phase, echo.sigma) == ("holding", 2)
    echo.internal()
    assert (echo.held, echo.phase, echo.sigma) == ([], "passive", NEVER)
