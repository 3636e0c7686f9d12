"""What happens at an instant, and in which order."""

import pytest

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from tests.support.devs_models import Clock, Echo, Log, Scripted, top, traced


def test_a_clock_ticks_at_exact_multiples_of_its_period() -> None:
    model = top(Clock("clock", 10 * MILLISECOND))
    messages = traced(Simulator(model), 10 * MILLISECOND * 1000)
    assert [(at, value) for at, _, value in messages] == [
        (10 * MILLISECOND * (count + 1), count) for count in range(1000)
    ]


def test_an_atomic_model_runs_as_the_root_and_takes_injected_input() -> None:
    assert traced(Simulator(Clock("clock", 3)), 7) == [(3, "ticks", 0), (6, "ticks", 1)]
    echo = Echo("echo", delay=2)
    simulator = Simulator(echo)
    simulator.inject(echo.inlet, 7)
    assert traced(simulator, 10) == [(2, "out", 7)]


def test_elapsed_counts_from_the_last_transition_and_continuing_keeps_the_planned_instant() -> None:
    clock, model = Clock("clock", 4), Scripted("model")
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    holds = iter([6, 3, NEVER])
    model.on_external = lambda _elapsed: model.hold_in("holding", next(holds))
    Simulator(root).run(12)  # inputs at 4, 8 and 12; internal at 8 + 3
    assert model.calls == [("external", 4), ("external", 4), ("internal", 0), ("external", 1)]
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


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
def test_a_timeout_that_every_input_puts_off_does_not_fill_the_memory(kind: type[Engine]) -> None:
    model = Scripted("model")
    model.on_external = lambda _elapsed: model.hold_in("waiting", SECOND)
    root = top(model, Clock("clock", MILLISECOND))
    inlet = root.in_port("in", int)
    root.couple(inlet, model.inlet)
    simulator = kind(root)
    for at in range(1000):
        simulator.inject(inlet, 1)
        simulator.advance(at)
    assert len(simulator.agenda.heap) < 100
    assert (simulator.next_at, simulator.due_at(model)) == (MILLISECOND, 999 + SECOND)
