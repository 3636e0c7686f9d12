"""How a loop around the simulator drives it: next_at, inject, advance, postpone, listen, exit."""

from collections.abc import Callable

import pytest

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.model_errors import ModelError, ModelFailure, PortTypeError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER, SECOND
from tests.support.devs_models import Clock, Echo, Log, Scripted, top


class Shell:
    """A log fed from outside, next to a clock with period 10."""

    def __init__(self, kind: type[Engine] = Simulator) -> None:
        self.clock, self.log = Clock("clock", 10), Log("log")
        self.model = top(self.clock, self.log)
        self.inlet = self.model.in_port("in", int)
        self.model.couple(self.inlet, self.log.values)
        self.simulator = kind(self.model)

    def inject(self, at: int, *values: int) -> None:
        for value in values:
            self.simulator.inject(self.inlet, value)
        self.simulator.advance(at)


def test_an_instant_is_advanced_to_and_may_be_again() -> None:
    shell = Shell()
    shell.simulator.advance(shell.simulator.next_at)
    assert (shell.simulator.now, shell.simulator.next_at, shell.clock.count) == (10, 20, 1)
    shell = Shell()
    shell.inject(10, 1)
    shell.inject(10, 2)
    assert (shell.log.bags, shell.log.elapsed) == ([[1], [2]], [10, 0])
    assert shell.clock.count == 1


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
def test_each_advance_to_an_instant_has_its_number(kind: type[Engine]) -> None:
    simulator = kind(top(Clock("clock", 10)))
    visits = []
    for at in (0, 0, 7, 7, 7, 10):
        simulator.advance(at)
        visits.append(simulator.visit)
    assert visits == [0, 1, 0, 1, 2, 0]


def test_an_input_arrives_between_events_with_its_elapsed_time() -> None:
    shell = Shell()
    shell.inject(3, 1, 2)
    shell.inject(7, 3)
    assert (shell.log.bags, shell.log.elapsed) == ([[1, 2], [3]], [3, 4])
    assert shell.simulator.next_at == 10


def test_an_input_at_an_internal_events_instant_is_confluent_with_it() -> None:
    echo = Echo("echo", delay=5)
    model = top(echo)
    inlet = model.in_port("in", int)
    model.couple(inlet, echo.inlet)
    simulator = Simulator(model)
    for at, value in ((0, 1), (5, 2)):
        simulator.inject(inlet, value)
        simulator.advance(at)
    assert (echo.held, simulator.next_at) == ([2], 10)


def test_run_first_delivers_what_was_injected_at_the_present_instant() -> None:
    shell = Shell()
    shell.simulator.run(15)
    shell.simulator.inject(shell.inlet, 1)
    shell.simulator.run(30)
    assert shell.log.elapsed == [10]
    assert shell.clock.count == 3


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
def test_the_end_of_a_run_is_inclusive_and_one_before_now_is_refused(kind: type[Engine]) -> None:
    clock = Clock("clock", 10)
    simulator = kind(top(clock))
    simulator.run(20)
    assert clock.count == 2
    with pytest.raises(ModelError, match=r"^top: cannot run to 0\.000000003 s, .*0\.000000020 s"):
        simulator.run(3)
    simulator.run(20)
    assert (clock.count, simulator.now) == (2, 20)
    simulator.run(30)
    assert clock.count == 3


BEYOND = r"^top: cannot advance to .*0\.000000005 s \(now\)"
EARLIER = r"^top\.clock: cannot postpone .*0\.000000010 s"


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
@pytest.mark.parametrize(
    ("use", "error", "sentence"),
    [
        *((lambda s, at=at: s.simulator.advance(at), ModelError, BEYOND) for at in (4, 11, NEVER)),
        *(
            (lambda s, at=at: s.simulator.postpone(s.clock, at), ModelError, EARLIER)
            for at in (9, 0, NEVER)
        ),
        (lambda s: s.simulator.postpone(s.log, SECOND), ModelError, r"^top\.log: cannot postpone"),
        (
            lambda s: s.simulator.inject(s.log.values, 1),
            ModelError,
            r"^top\.log\.values: not an input port of top$",
        ),
        (
            lambda s: s.simulator.inject(s.inlet, 1.5),
            PortTypeError,
            r"^top at .*: port 'in' carries int, not 1\.5$",
        ),
        (
            lambda s: s.simulator.due_at(Clock("stranger", 1)),
            ModelError,
            r"^stranger: not an atomic model in top$",
        ),
    ],
)
def test_what_a_loop_may_not_ask_for_is_refused(
    use: Callable[[Shell], object], error: type[ModelError], sentence: str, kind: type[Engine]
) -> None:
    shell = Shell(kind)
    shell.inject(5, 1)
    with pytest.raises(error, match=sentence):
        use(shell)
    assert shell.simulator.due_at(shell.clock) == 10
    with pytest.raises(ModelError, match="cannot advance to never"):
        kind(top(Log("log"))).advance(NEVER)


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
def test_a_run_passes_over_what_inputs_have_put_off(kind: type[Engine]) -> None:
    clock, model = Clock("clock", 3), Scripted("model", sigma=5)
    root = top(clock, model)
    root.couple(clock.ticks, model.inlet)
    model.on_external = lambda _elapsed: model.hold_in("waiting", 5)
    simulator = kind(root)
    simulator.run(10)
    assert model.calls == [("external", 3)] * 3
    assert simulator.next_at == 12


def test_an_event_may_be_postponed_to_the_instant_at_which_it_is_due() -> None:
    shell = Shell()
    shell.simulator.postpone(shell.clock, 10)
    assert shell.simulator.due_at(shell.clock) == 10


def test_a_postponed_model_holds_its_phase_longer_and_input_leaves_the_rest_of_it() -> None:
    shell = Shell()
    shell.simulator.postpone(shell.clock, 25)
    assert shell.simulator.due_at(shell.clock) == shell.simulator.next_at == 25
    shell.simulator.run(40)
    assert (shell.clock.count, shell.simulator.due_at(shell.clock)) == (2, 45)
    model = Scripted("model", sigma=10)
    simulator = Simulator(model)
    simulator.postpone(model, 30)
    simulator.inject(model.inlet, 1)
    simulator.advance(12)
    assert (model.sigma, simulator.due_at(model)) == (18, 30)


def test_listeners_are_called_in_the_order_in_which_they_came() -> None:
    shell = Shell()
    received: list[tuple[str, int, int]] = []
    shell.simulator.listen(shell.clock.ticks, lambda at, value: received.append(("a", at, value)))
    shell.simulator.listen(shell.clock.ticks, lambda at, value: received.append(("b", at, value)))
    shell.simulator.run(20)
    assert received == [("a", 10, 0), ("b", 10, 0), ("a", 20, 1), ("b", 20, 1)]


def test_a_listener_that_ends_is_called_no_more_and_leaves_nothing_behind() -> None:
    shell = Shell()
    received: list[str] = []
    first = shell.simulator.listen(shell.clock.ticks, lambda _at, _value: received.append("first"))
    with shell.simulator.listen(shell.clock.ticks, lambda _at, _value: received.append("second")):
        shell.simulator.run(10)
        first.end()
        first.end()
        shell.simulator.run(20)
    shell.simulator.run(30)
    assert received == ["first", "second", "second"]
    assert shell.clock.ticks.listeners == ()
    assert shell.log.bags == []


def test_a_listener_may_end_itself_while_it_is_called() -> None:
    shell = Shell()
    received: list[int] = []

    def once(_at: int, value: int) -> None:
        received.append(value)
        listening.end()

    listening = shell.simulator.listen(shell.clock.ticks, once)
    shell.simulator.listen(shell.clock.ticks, lambda _at, value: received.append(-value))
    shell.simulator.run(30)
    assert received == [0, 0, -1, -2]


def test_one_listener_at_a_coupled_model_ends_at_every_source() -> None:
    inner = Coupled("inner")
    clocks = [inner.add(Clock("slow", 10)), inner.add(Clock("fast", 5))]
    inner_out = inner.out_port("out", int)
    simulator = Simulator(top(inner))
    for clock in clocks:
        inner.couple(clock.ticks, inner_out)
    received: list[int] = []
    listening = simulator.listen(inner_out, lambda _at, value: received.append(value))
    simulator.run(10)
    listening.end()
    simulator.run(20)
    assert received == [0, 0, 1]


def test_a_listener_of_an_earlier_simulator_may_end_later() -> None:
    shell = Shell()
    listening = shell.simulator.listen(shell.clock.ticks, lambda _at, _value: None)
    second = Simulator(shell.model)
    received: list[int] = []
    second.listen(shell.clock.ticks, lambda _at, value: received.append(value))
    listening.end()
    second.run(10)
    assert len(received) == 1


def test_a_coupled_models_output_is_listened_to_at_its_sources() -> None:
    inner = Coupled("inner")
    clocks = [inner.add(Clock("slow", 10)), inner.add(Clock("fast", 5))]
    inner_out = inner.out_port("out", int)
    model = top(inner)
    outer_out = model.out_port("out", int)
    model.couple(inner_out, outer_out)
    for clock in clocks:
        inner.couple(clock.ticks, inner_out)
    simulator = Simulator(model)
    received: list[tuple[int, int]] = []
    simulator.listen(outer_out, lambda at, value: received.append((at, value)))
    simulator.run(10)
    assert received == [(5, 0), (10, 0), (10, 1)]


def test_an_output_fed_straight_from_an_input_is_listened_to_at_every_source() -> None:
    inner, clock = Coupled("inner"), Clock("clock", 5)
    inlet, outlet = inner.in_port("in", int), inner.out_port("out", int)
    inner.couple(inlet, outlet)
    model = top(clock, inner)
    entry, leaving = model.in_port("in", int), model.out_port("out", int)
    for source in (clock.ticks, entry):
        model.couple(source, inlet)
    model.couple(outlet, leaving)
    simulator = Simulator(model)
    received: list[tuple[int, int]] = []
    simulator.listen(leaving, lambda at, value: received.append((at, value)))
    simulator.inject(entry, 7)
    simulator.advance(3)
    simulator.run(5)
    assert received == [(3, 7), (5, 0)]


def test_listening_changes_nothing_and_a_new_simulator_takes_the_ports_over() -> None:
    clock, logs = Clock("clock", 1), [Log("first"), Log("second")]
    model = top(clock, *logs)
    for log in logs:
        model.couple(clock.ticks, log.values)
    simulator = Simulator(model)
    simulator.listen(clock.ticks, lambda _at, _value: None)
    simulator.run(2)
    assert [log.bags for log in logs] == [[[0], [1]]] * 2
    shell = Shell()
    shell.simulator.inject(shell.inlet, 1)
    shell.simulator.listen(shell.clock.ticks, lambda _at, _value: pytest.fail("still listening"))
    second = Simulator(shell.model)
    second.run(20)
    second.inject(shell.inlet, 2)
    second.advance(20)
    assert shell.log.bags == [[2]]


def test_models_exit_in_reverse_order_and_each_one_though_others_fail() -> None:
    exited: list[str] = []

    class Leaving(Clock):
        def exit(self) -> None:
            exited.append(self.name)
            if self.name == "b":
                raise OSError("no bus")

    simulator = Simulator(top(*(Leaving(name, 1) for name in "abc")))
    failures = simulator.exit()
    assert exited == ["c", "b", "a"]
    assert [str(failure) for failure in failures] == [
        "top.b at 0.000000000 s: its exit raised OSError: no bus"
    ]
    assert isinstance(failures[0], ModelFailure)
    assert isinstance(failures[0].__cause__, OSError)


def test_a_state_that_was_kept_is_gone_on_with_by_another_simulator() -> None:
    shell, other = Shell(), Shell()
    shell.inject(3, 1)
    shell.simulator.run(12)
    other.simulator.restore(shell.simulator.state())
    assert (other.simulator.now, other.simulator.next_at) == (10, 20)
    other.inject(15, 7)
    assert other.log.elapsed == [12]  # since it had the first
    with pytest.raises(ValueError, match="2 models; expected 1"):
        Simulator(top(Clock("alone", 1))).restore(shell.simulator.state())
