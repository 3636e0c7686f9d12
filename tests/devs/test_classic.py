"""Classic DEVS: one imminent model at a time, one message at a time."""

from collections.abc import Callable, Sequence

import pytest

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelFailure, SelectError
from firmware_runtime.devs.time import NEVER
from tests.support.devs_models import Clock, Echo, Log, Scripted, top, traced


class Choosing(Coupled):
    """Selects as scripted; keeps what it was asked."""

    def __init__(self, name: str, choose: Callable[[Sequence[Component]], Component]) -> None:
        super().__init__(name)
        self.choose = choose
        self.asked: list[list[str]] = []

    def select(self, imminent: Sequence[Component]) -> Component:
        self.asked.append([component.name for component in imminent])
        return self.choose(imminent)


def last(imminent: Sequence[Component]) -> Component:
    return imminent[-1]


def test_imminent_models_go_in_order_of_declaration_by_default() -> None:
    model = top(Clock("b", 2), Clock("a", 1))
    assert traced(ClassicSimulator(model), 2) == [
        (1, "a.ticks", 0),
        (2, "b.ticks", 0),
        (2, "a.ticks", 1),
    ]


def test_select_chooses_who_goes_first_and_is_asked_again_for_the_rest() -> None:
    model = Choosing("top", last)
    for name in "abc":
        model.add(Clock(name, 5))
    assert [path for _, path, _ in traced(ClassicSimulator(model), 5)] == [
        "c.ticks",
        "b.ticks",
        "a.ticks",
    ]
    assert model.asked == [["a", "b", "c"], ["a", "b"]]


def test_every_level_selects_among_its_own_components_from_the_root_down() -> None:
    left, right = Choosing("left", last), Coupled("right")
    root = Choosing("root", lambda imminent: imminent[0])
    root.add(right)
    root.add(left)
    for side in (left, right):
        for name in "ab":
            side.add(Clock(f"{side.name}_{name}", 5))
    paths = [path for _, path, _ in traced(ClassicSimulator(root), 5)]
    assert paths == [
        "right.right_a.ticks",
        "right.right_b.ticks",
        "left.left_b.ticks",
        "left.left_a.ticks",
    ]
    assert root.asked == [["right", "left"], ["right", "left"]]
    assert left.asked == [["left_a", "left_b"]]


def test_a_select_that_chooses_a_stranger_is_refused() -> None:
    model = Choosing("top", lambda _imminent: Clock("stranger", 1))
    for name in "ab":
        model.add(Clock(name, 5))
    with pytest.raises(SelectError, match=r"^top at 0\.000000005 s: .* expected one of a, b$"):
        ClassicSimulator(model).run(5)


def test_an_exception_in_select_names_the_coupled_model() -> None:
    def fail(_imminent: Sequence[Component]) -> Component:
        raise KeyError("who")

    model = Choosing("top", fail)
    for name in "ab":
        model.add(Clock(name, 5))
    with pytest.raises(ModelFailure, match=r"^top at .*: its select raised KeyError: 'who'$"):
        ClassicSimulator(model).run(5)


def test_every_value_sent_is_an_external_transition_of_its_own() -> None:
    sender, logs = Scripted("sender", sigma=3), [Log("first"), Log("second")]

    def send() -> None:
        for value in (7, 8):
            sender.outlet.send(value)

    sender.on_output = send
    model = top(sender, *logs)
    for log in logs:
        model.couple(sender.outlet, log.values)
    simulator = ClassicSimulator(model)
    simulator.run(3)
    for log in logs:
        assert (log.bags, log.elapsed) == ([[7], [8]], [3, 0])
        assert list(log.values) == []
    assert (simulator.internal_transitions, simulator.external_transitions) == (1, 4)


def test_simultaneous_values_of_two_senders_arrive_apart() -> None:
    clocks, log = [Clock("a", 5), Clock("b", 5)], Log("log")
    model = top(*clocks, log)
    for clock in clocks:
        model.couple(clock.ticks, log.values)
    ClassicSimulator(model).run(5)
    assert log.bags == [[0], [0]]


def test_the_sender_has_had_its_internal_transition_when_its_values_arrive() -> None:
    order: list[str] = []
    sender, receiver = Scripted("sender", sigma=1), Scripted("receiver")
    sender.on_output = lambda: sender.outlet.send(1)

    def transit() -> None:
        order.append("sender transits")
        sender.passivate()

    def receive(_elapsed: int) -> None:
        order.append("receiver receives")
        receiver.passivate()

    sender.on_internal, receiver.on_external = transit, receive
    model = top(receiver, sender)
    model.couple(sender.outlet, receiver.inlet)
    ClassicSimulator(model).run(1)
    assert order == ["sender transits", "receiver receives"]


def receiver_due_with_sender(on_external: Callable[[Scripted, int], None]) -> Scripted:
    """A model due at 4 that gets an input at 4 first."""
    clock, model = Clock("clock", 4), Scripted("model", sigma=4)
    model.on_external = lambda elapsed: on_external(model, elapsed)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    ClassicSimulator(root).run(5)
    return model


def test_an_imminent_model_that_gets_input_first_has_its_full_time_elapsed_and_stays() -> None:
    model = receiver_due_with_sender(lambda model, elapsed: model.continue_(elapsed))
    assert model.calls == [("external", 4), ("internal", 0)]


@pytest.mark.parametrize("sigma", [3, NEVER])
def test_an_imminent_model_whose_input_gives_it_more_time_is_not_imminent_now(sigma: int) -> None:
    model = receiver_due_with_sender(lambda model, _elapsed: model.hold_in("later", sigma))
    assert model.calls == [("external", 4)]


def test_a_passive_model_that_becomes_imminent_takes_its_turn_among_the_others() -> None:
    clock, late = Clock("clock", 4), Clock("late", 4)
    model = Scripted("model")
    model.on_external = lambda _elapsed: model.activate()
    model.on_output = lambda: model.outlet.send(9)
    root = top(clock, model, late)
    root.couple(clock.ticks, model.inlet)
    assert [path for _, path, _ in traced(ClassicSimulator(root), 4)] == [
        "clock.ticks",
        "model.out",
        "late.ticks",
    ]


def test_injected_values_arrive_first_one_by_one() -> None:
    clock, log = Clock("clock", 4), Log("log")
    root = top(clock, log)
    inlet = root.in_port("in", int)
    root.couple(inlet, log.values)
    root.couple(clock.ticks, log.values)
    simulator = ClassicSimulator(root)
    simulator.inject(inlet, 7)
    simulator.inject(inlet, 8)
    simulator.advance(4)
    assert (log.bags, log.elapsed) == ([[7], [8], [0]], [4, 0, 0])
    simulator.advance(4)
    assert simulator.visit == 1  # of this instant, after its first


def test_an_answer_to_an_injected_value_is_of_the_first_round() -> None:
    echo = Echo("echo")
    simulator = ClassicSimulator(echo, zero_time_limit=1)
    simulator.inject(echo.inlet, 7)
    assert traced(simulator, 0) == [(0, "out", 7)]


def test_listeners_and_checked_mode_work_as_in_the_parallel_simulator() -> None:
    model = top(Clock("clock", 4))
    assert traced(ClassicSimulator(model, checked=True), 8) == [
        (4, "clock.ticks", 0),
        (8, "clock.ticks", 1),
    ]


def test_the_confluent_function_is_never_called() -> None:
    class Strict(Scripted):
        def confluent(self) -> None:
            pytest.fail("classic DEVS has no confluent function")

    model = Strict("model", sigma=4)
    simulator = ClassicSimulator(model)
    simulator.inject(model.inlet, 1)
    simulator.advance(4)
    assert model.calls == [("external", 4), ("internal", 0)]
