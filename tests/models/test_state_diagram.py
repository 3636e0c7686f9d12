from dataclasses import dataclass
from itertools import groupby
from typing import ClassVar

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelFailure
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State, StateTableError, Words


@dataclass(frozen=True)
class Message:
    value: float


@dataclass(frozen=True)
class Angle(Message):
    pass


def is_double(value: int, kept: Kept) -> bool:
    return bool(value == 2 * kept["number"])


def successor(kept: Kept) -> int:
    return int(kept["number"]) + 1


def is_even(kept: Kept) -> bool:
    return bool(kept["number"] % 2 == 0)


def is_negative(kept: Kept) -> bool:
    return bool(kept["number"] < 0)


class Machine(StateDiagram):
    words: ClassVar[Words] = {
        "number": int,
        "double": is_double,
        "successor": successor,
        "angle": Angle,
    }

    def __init__(self, *states: State) -> None:
        super().__init__("machine")
        self.first = self.in_port("first", int)
        self.second = self.in_port("second", int)
        self.message = self.in_port("message", Message)
        self.text = self.in_port("text", list)
        self.out = self.out_port("out", int)
        self.also = self.out_port("also", Message)
        self.follow(states, self.words, short=5 * MILLISECOND, long=100 * MILLISECOND)


def run(states: tuple[State, ...], *inputs: tuple[int, str, object]) -> list[tuple[int, object]]:
    """What a machine sends within 1 s, as (ms, value), on inputs (ms, port, value)."""
    machine = Machine(*states)
    simulator = Simulator(machine, checked=True)
    received: list[tuple[int, object]] = []

    def receive(at: int, value: object) -> None:
        received.append((at // MILLISECOND, value))

    simulator.listen(machine.out, receive)
    simulator.listen(machine.also, receive)
    for at_ms, group in groupby(inputs, lambda each: each[0]):
        simulator.run(max(simulator.now, at_ms * MILLISECOND - 1))
        for _, port, value in group:
            simulator.inject(machine.in_ports[port], value)
        simulator.advance(at_ms * MILLISECOND)
    simulator.run(1000 * MILLISECOND)
    return received


ECHO = (
    State("Idle", NEVER, Arrow("first?1", "Busy")),
    State("Busy", "long", Arrow("out!7", "Idle")),
)


def test_an_input_takes_its_arrow_and_the_duration_ends_with_an_output() -> None:
    assert run(ECHO, (20, "first", 1)) == [(120, 7)]


def test_an_input_of_another_value_has_no_effect() -> None:
    assert run(ECHO, (20, "first", 2)) == []


def test_an_input_that_the_state_does_not_name_leaves_its_duration_running() -> None:
    inputs = [(20 + 10 * number, "first", 1) for number in range(10)]
    assert run(ECHO, *inputs, (115, "second", 3)) == [(120, 7)]


def test_an_input_at_the_very_end_of_a_duration_meets_the_next_state() -> None:
    assert run(ECHO, (20, "first", 1), (120, "first", 1)) == [(120, 7), (220, 7)]


def test_an_arrow_back_to_its_own_state_restarts_the_duration() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?1", "Busy")),
        State("Busy", "long", Arrow("out!7", "Idle"), Arrow("second?1", "Busy")),
    )
    assert run(states, (20, "first", 1), (90, "second", 1)) == [(190, 7)]


def test_the_initial_state_is_the_first_and_may_end_by_itself() -> None:
    states = (State("Begin", "short", Arrow("out!1", "Done")), State("Done", NEVER))
    assert run(states) == [(5, 1)]


def test_a_state_may_end_at_once_and_in_silence() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?1", "Through")),
        State("Through", 0, Arrow("", "Last")),
        State("Last", 0, Arrow("out!9", "Idle")),
    )
    assert run(states, (20, "first", 1)) == [(20, 9)]


def test_a_label_may_send_on_several_ports() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?1", "Busy")),
        State("Busy", "short", Arrow("out!1 also!2.5 out!3", "Idle")),
    )
    assert run(states, (20, "first", 1)) == [(25, 1), (25, Message(2.5)), (25, 3)]


def test_inputs_of_one_instant_are_taken_in_order_of_the_ports_declaration() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?1", "Waiting")),
        State("Waiting", NEVER, Arrow("second?1", "Busy")),
        State("Busy", "short", Arrow("out!1", "Idle")),
    )
    assert run(states, (20, "second", 1), (20, "first", 1)) == [(25, 1)]


def test_values_of_one_port_are_taken_in_order_of_arrival() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?number", "Second")),
        State("Second", NEVER, Arrow("first?double", "Busy")),
        State("Busy", "short", Arrow("out!number", "Idle")),
    )
    assert run(states, (20, "first", 4), (20, "first", 9), (20, "first", 8)) == [(25, 4)]


def test_a_kept_value_is_sent_and_computed_with() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?number", "Busy")),
        State("Busy", "short", Arrow("out!number out!successor", "Idle")),
    )
    assert run(states, (20, "first", 41)) == [(25, 41), (25, 42)]


def test_kinds_of_message_on_one_port_are_distinguished() -> None:
    states = (
        State("Idle", NEVER, Arrow("message?angle", "Angle"), Arrow("message?1", "Signal")),
        State("Angle", "short", Arrow("also!angle", "Idle")),
        State("Signal", "short", Arrow("out!1", "Idle")),
    )
    received = run(states, (20, "message", Message(1)), (50, "message", Angle(1)))
    assert received == [(25, 1), (55, Angle(1))]


def test_a_condition_chooses_between_arrows_without_input() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?number", "Busy")),
        State(
            "Busy",
            "short",
            Arrow("out!0", "Idle", when=is_even),
            Arrow("out!-1", "Idle", when=is_negative),
        ),
    )
    assert run(states, (20, "first", 4), (50, "first", -3)) == [(25, 0), (55, -1)]
    with pytest.raises(ModelFailure, match="in phase 'Busy': no arrow's condition holds"):
        run(states, (20, "first", 3))


def test_a_condition_on_an_input_judges_what_was_kept_before() -> None:
    states = (
        State("Idle", NEVER, Arrow("first?number", "Armed")),
        State("Armed", NEVER, Arrow("second?number", "Busy", when=is_even)),
        State("Busy", "short", Arrow("out!number", "Idle")),
    )
    assert run(states, (20, "first", 2), (30, "second", 5)) == [(35, 5)]
    assert run(states, (20, "first", 5), (30, "second", 2)) == []


def test_a_second_run_keeps_nothing_of_the_first() -> None:
    machine = Machine(*ECHO)
    Simulator(machine).inject(machine.first, 1)
    machine.kept["number"] = 5
    Simulator(machine)
    assert machine.phase == "Idle"
    assert machine.kept == {}


IDLE = State("Idle", NEVER, Arrow("first?1", "Busy"))
BUSY = State("Busy", "short", Arrow("out!1", "Idle"))


@pytest.mark.parametrize(
    ("states", "fault"),
    [
        ((), "expected at least one, each declared once"),
        ((IDLE, BUSY, BUSY), "expected at least one, each declared once"),
        ((IDLE, State("Busy", "short", Arrow("", "Bsuy"))), "no state 'Bsuy' to lead to"),
        ((IDLE, BUSY, State("Lost", NEVER)), r"no arrow leads from 'Idle' to \['Lost'\]"),
        ((State("Idle", NEVER, Arrow("out!1", "Idle")),), "none if it does not"),
        ((State("Idle", "short", Arrow("first?1", "Idle")),), "an arrow without input if it ends"),
        (
            (IDLE, State("Busy", "short", Arrow("out!1", "Idle"), Arrow("", "Busy"))),
            "each needs a condition",
        ),
        ((IDLE, State("Busy", "medium", Arrow("", "Idle"))), "'medium'; expected one of short"),
        ((IDLE, State("Busy", -1, Arrow("", "Idle"))), "expected whole nanoseconds"),
        ((State("Idle", NEVER, Arrow("first?1 second?1", "Idle")),), "expected one port[?]value"),
        ((State("Idle", "short", Arrow("out=1", "Idle")),), "expected one port[?]value"),
        (
            (State("Idle", NEVER, Arrow("third?1", "Idle")),),
            "third[?]1: no input port 'third'; expected one of first, second, message, text",
        ),
        (
            (State("Idle", "short", Arrow("first!1", "Idle")),),
            "first!1: no output port 'first'; expected one of out, also",
        ),
        (
            (State("Idle", NEVER, Arrow("first?many", "Idle")),),
            r"a declared word \(number, double, successor, angle\)",
        ),
        ((State("Idle", NEVER, Arrow("text?1", "Idle")),), "a port of list carries no number"),
        ((State("Idle", "short", Arrow("out!number", "Idle")),), "no input ever keeps a 'number'"),
    ],
)
def test_a_table_that_does_not_hold_together_is_refused(
    states: tuple[State, ...], fault: str
) -> None:
    with pytest.raises(StateTableError, match=fault):
        Machine(*states)


def test_a_refusal_names_the_model() -> None:
    with pytest.raises(StateTableError, match=r"^machine: state"):
        Machine(State("Idle", "medium", Arrow("", "Idle")))


def test_the_table_as_declared_is_there_to_be_drawn() -> None:
    machine = Machine(*ECHO)
    assert [state.name for state in machine.states] == ["Idle", "Busy"]
    assert machine.durations == {"Idle": NEVER, "Busy": 100 * MILLISECOND}


def test_a_state_diagram_is_a_component_like_any_other() -> None:
    top = Coupled("top")
    machine = top.add(Machine(*ECHO))
    entrance = top.in_port("entrance", int)
    top.couple(entrance, machine.first)
    simulator = Simulator(top)
    simulator.inject(entrance, 1)
    simulator.advance(0)
    assert simulator.next_at == 100 * MILLISECOND
