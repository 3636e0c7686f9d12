"""The engine of quantized systems: states, functions, events and signals in one atomic model.

Everything that is solved here is parts of one kind or another:

- a *signal* is a polynomial in time that functions and events read: of an input port, of a discrete
  value, of a quantized state q, or of the exact state x, which events read;
- a *state* renews q when x has moved by its quantum (`methods`);
- a *function* is evaluated whenever a signal that it reads is new, when one of its conditions
  changes, and before what its Taylor polynomial leaves out matters; it gives a state its derivative
  or is sent;
- an *event* happens where its expression crosses zero or a port brings something, and sets states
  and discrete values.

Each part knows when it is next due; an instant is worked off in rounds, states first, then
functions, then events, until nothing is due any more. What has changed is sent at that instant. A
`System` becomes one engine, and so does each block of a diagram.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.models.qss.crossing import Crossing
from firmware_runtime.models.qss.expression import names_of, parse
from firmware_runtime.models.qss.function import Function
from firmware_runtime.models.qss.methods import State
from firmware_runtime.models.qss.program import Layout, compile_expression
from firmware_runtime.models.qss.segment import NANO, Segment
from firmware_runtime.models.qss.signals import Readings, Signal
from firmware_runtime.models.qss.watch import worth

_MOST_ROUNDS: Final = 10_000
"""So many rounds at one instant are a livelock."""


@dataclass(frozen=True, slots=True)
class Setting:
    """What an event sets: expressions by the name of a state or a discrete value."""

    programs: Mapping[str, tuple[Any, Readings]]
    only_if: tuple[Any, Readings] | None


class Engine(Atomic):
    """One quantized system; subclasses add its parts in `__init__`.

    idle (until a part is due) --> sending (0) --what has changed!--> idle; --any port?--> sending
    """

    def __init__(self, name: str, *, is_inner: bool = False) -> None:
        super().__init__(name)
        self.signals: dict[str, Signal] = {}
        """By their names in expressions: inputs, discrete values, quantized states."""
        self.exact_signals: dict[str, Signal] = {}
        """The same for events, which read the exact states."""
        self.states: dict[str, State] = {}
        self.held: dict[str, Signal] = {}
        """The discrete values."""
        self._is_inner = is_inner
        self._has_missing = False
        self._at = 0
        self._names: list[str] = []
        """Of the states, in order."""
        self._functions: list[Function] = []
        self._targets: list[int | OutPort[Segment]] = []
        """For each function the number of the state whose derivative it is, or where it is sent."""
        self._crossings: list[Crossing] = []
        self._assignments: list[Setting] = []
        self._events: list[OutPort[bool] | None] = []
        self._sides: list[OutPort[Segment] | None] = []
        self._due_states: list[int] = [NEVER]
        self._due_functions: list[int] = [NEVER]
        self._due_crossings: list[int] = [NEVER]
        self._wired: list[tuple[InPort[Segment], Signal]] = []
        self._derivatives: list[tuple[InPort[Segment], int]] = []
        self._setters: list[tuple[InPort[Segment], str]] = []
        self._triggers: list[tuple[InPort[bool], int]] = []
        self._value_ports: dict[str, OutPort[Segment]] = {}
        self._state_ports: dict[str, OutPort[Segment]] = {}
        self._pending: list[tuple[str, Any]] = []

    # Parts ---------------------------------------------------------------------------------------

    def path_of(self, part: str) -> str:
        """Where a part is, for errors."""
        if self._is_inner and self.parent is not None:
            return f"{self.parent.path}.{part}"
        return self.path

    def add_input(
        self, name: str, count: int, initial: float | None = None, port: str | None = None
    ) -> InPort[Segment]:
        """A signal that comes by a port, in so many coefficients."""
        self.signals[name] = self.exact_signals[name] = signal = Signal(name, count, initial)
        entrance = self.in_port(port or name, Segment)
        self._wired.append((entrance, signal))
        self._note_missing()
        return entrance

    def add_held(self, name: str, initial: float) -> None:
        """A value that changes at events only."""
        self.signals[name] = self.exact_signals[name] = Signal(name, 1, float(initial))
        self.held[name] = self.signals[name]

    def add_state(
        self, name: str, method: type[State], initial: float, quantum: float, relative: float
    ) -> State:
        """A quantized state, as yet without a derivative."""
        state = method(partial(self.path_of, name), initial, quantum, relative)
        self.signals[name] = Signal(name, method.order, float(initial))
        self.exact_signals[name] = Signal(name, method.order + 1, float(initial))
        self.exact_signals[name].state = state
        self.states[name] = state
        self._names.append(name)
        self._due_states.insert(-1, 0)
        return state

    def add_function(
        self,
        name: str,
        text: str,
        target: str | OutPort[Segment],
        **options: Any,  # noqa: ANN401 -- those of `Function`
    ) -> None:
        """The derivative of a state, by its name, or what is sent."""
        read = [self.signals[each] for each in names_of(parse(text)) if each in self.signals]
        readings = Readings(partial(self.path_of, name), text, read)
        number = len(self._functions)
        for signal in read:
            signal.functions.append(number)
        self._functions.append(Function(readings, **options))
        self._targets.append(self._names.index(target) if isinstance(target, str) else target)
        self._due_functions.insert(-1, 0)

    def add_crossing(
        self,
        name: str,
        text: str,
        parameters: Mapping[str, float],
        *,
        event: OutPort[bool] | None = None,
        side: OutPort[Segment] | None = None,
        **options: Any,  # noqa: ANN401 -- those of `Crossing`
    ) -> None:
        """An event that happens where an expression of exact states crosses zero."""
        readings, layout = self._readings(name, text, parameters)
        number = len(self._crossings)
        for signal in readings.signals:
            signal.crossings.append(number)
        self._crossings.append(Crossing(readings, layout, **options))
        self._events.append(event)
        self._sides.append(side)
        self._due_crossings.insert(-1, 0)

    def add_assignment(
        self,
        name: str,
        values: Mapping[str, str],
        only_if: str | None,
        parameters: Mapping[str, float],
    ) -> None:
        """What the event of the same number sets."""

        def compiled(text: str) -> tuple[Any, Readings]:
            readings, layout = self._readings(name, text, parameters)
            return compile_expression(parse(text), layout, 1), readings

        programs = {target: compiled(text) for target, text in values.items()}
        condition = None if only_if is None else compiled(f"1.0 if {only_if} else 0.0")
        self._assignments.append(Setting(programs, condition))

    def _readings(
        self, name: str, text: str, parameters: Mapping[str, float]
    ) -> tuple[Readings, Layout]:
        read = [
            self.exact_signals[each] for each in names_of(parse(text)) if each in self.exact_signals
        ]
        layout = Layout({each.name: each.count for each in read}, parameters)
        return Readings(partial(self.path_of, name), text, read), layout

    def set_by(self, port: InPort[Segment], name: str) -> None:
        """Let a port set a state or a discrete value."""
        self._setters.append((port, name))

    def derive_by(self, port: InPort[Segment], name: str) -> None:
        """Let a port bring the derivative of a state."""
        self._derivatives.append((port, self._names.index(name)))

    def trigger_by(self, port: InPort[bool], number: int) -> None:
        """Let whatever comes by a port be the event of an assignment."""
        self._triggers.append((port, number))

    def send_value(self, name: str, port: OutPort[Segment]) -> None:
        """Send a quantized state or a discrete value whenever it is new."""
        self._value_ports[name] = port

    def send_state(self, name: str, port: OutPort[Segment]) -> None:
        """Send an exact state whenever its polynomial is new."""
        self._state_ports[name] = port

    # The DEVS functions --------------------------------------------------------------------------

    def initialize(self) -> None:
        """Begin at once."""
        for name in self.held:
            self._send(name, self._value_ports, self.held[name].coefficients)
        self.activate("idle")

    def output(self) -> None:
        """Send what has changed."""
        for port, value in self._pending:
            self.out_ports[port].send(value)

    def internal(self) -> None:
        """Work off what is due now."""
        self._at += self.sigma
        self._pending = []
        self._settle()

    def external(self, elapsed: int) -> None:
        """Take inputs in."""
        self._at += elapsed
        for port, signal in self._wired:
            if port:
                self._put(signal, port[-1])
        for derivative, number in self._derivatives:
            if derivative:
                self._derive(
                    number, self._checked(derivative[-1], self.states[self._names[number]].order)
                )
        triggered = [number for trigger, number in self._triggers if trigger]
        if triggered:
            self._happen(triggered)
        for setter, name in self._setters:
            if setter:
                self._set(name, setter[-1][0])
        self._settle()

    def confluent(self) -> None:
        """Take inputs in before what is due now is worked off."""
        self._at += self.sigma
        self._pending = []
        self.external(0)

    def state(self) -> dict[str, Any]:
        """What changes, as plain values."""
        parts = [[_copied(getattr(part, name)) for name in part.kept] for part in self._parts()]
        due = [self._due_states, self._due_functions, self._due_crossings]
        own = [self._at, self.phase, self.sigma, [list(each) for each in self._pending]]
        return {"parts": parts, "due": [list(each) for each in due], "own": own}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        for part, values in zip(self._parts(), state["parts"], strict=True):
            for name, value in zip(part.kept, values, strict=True):
                setattr(part, name, _copied(value))
        self._due_states, self._due_functions, self._due_crossings = map(list, state["due"])
        self._at, self.phase, self.sigma, pending = state["own"]
        self._pending = [tuple(each) for each in pending]
        self._note_missing()

    def _parts(self) -> list[Any]:
        signals = {
            id(each): each for each in (*self.signals.values(), *self.exact_signals.values())
        }
        return [*signals.values(), *self.states.values(), *self._functions, *self._crossings]

    # One instant ---------------------------------------------------------------------------------

    def _settle(self) -> None:
        now = self._at
        states, functions, crossings = self._due_states, self._due_functions, self._due_crossings
        for _ in range(_MOST_ROUNDS):
            while (due := min(states)) <= now:
                self._requantize(states.index(due))
            while (due := min(functions)) <= now:
                self._evaluate(functions.index(due))
            if min(states) <= now:
                continue
            happened = []
            while (due := min(crossings)) <= now:
                number = crossings.index(due)
                if self._look(number):
                    happened.append(number)
            if happened:
                self._happen(sorted(happened))
            elif min(crossings) > now:
                break
        else:
            raise ModelError(
                f"{self.path}: {_MOST_ROUNDS} rounds at {format_time(now)}; "
                "expected steps and events that do not cause each other without end"
            )
        due = now if self._pending else min(min(states), min(functions), min(crossings))  # noqa: PLW3301 -- it is quicker so
        self.sigma = NEVER if due >= NEVER else due - now

    def _requantize(self, number: int) -> None:
        name = self._names[number]
        state = self.states[name]
        self._due_states[number] = state.requantize(self._at)
        q = [state.q0, state.q1, state.q2][: state.order]
        self._renew(self.signals[name], q)
        self._send(name, self._value_ports, q)
        if state.steps == 1:
            self._change_exact(name)

    def _evaluate(self, number: int) -> None:
        now, function = self._at, self._functions[number]
        if self._has_missing and function.readings.are_missing:
            self._due_functions[number] = NEVER
            return
        is_continuous = self._due_functions[number] >= 0
        segment, self._due_functions[number] = function.evaluate(now, is_continuous=is_continuous)
        target = self._targets[number]
        if isinstance(target, int):
            self._derive(target, segment)
        else:
            self._pending.append((target.name, Segment(*segment)))

    def _derive(self, number: int, derivative: Sequence[float]) -> None:
        name = self._names[number]
        self._due_states[number] = self.states[name].derive(self._at, derivative)
        self._change_exact(name)

    def _look(self, number: int) -> bool:
        """Whether the event of this number happens."""
        now, crossing = self._at, self._crossings[number]
        if self._has_missing and crossing.readings.are_missing:
            self._due_crossings[number] = NEVER
            return False
        was = crossing.side
        happens, self._due_crossings[number] = crossing.look(now)
        event, side = self._events[number], self._sides[number]
        if side is not None and crossing.side is not was:
            self._pending.append((side.name, Segment(1.0 if crossing.side else 0.0)))
        if event is not None and happens:
            self._pending.append((event.name, bool(crossing.side)))
        return happens

    def _happen(self, numbers: Sequence[int]) -> None:
        """The assignments of events: all are evaluated before any is made."""
        values: dict[str, float] = {}
        for number in numbers:
            if number < len(self._assignments):
                assignment = self._assignments[number]
                if assignment.only_if is None or self._worth(assignment.only_if) != 0.0:
                    found = assignment.programs.items()
                    values |= {name: self._worth(program) for name, program in found}
        for name, value in values.items():
            self._set(name, value)

    def _worth(self, compiled: tuple[Any, Readings]) -> float:
        program, readings = compiled
        try:
            return worth(program, self._at * NANO, readings.at(self._at))
        except (ValueError, ArithmeticError) as error:
            raise readings.no_value(self._at, error) from error

    # Changes -------------------------------------------------------------------------------------

    def _set(self, name: str, value: float) -> None:
        if name in self.states:
            self._due_states[self._names.index(name)] = self.states[name].reset(self._at, value)
            self._change_exact(name)
        elif name in self.held:
            self._renew(self.held[name], [value])
            self._send(name, self._value_ports, [value])
        else:
            self._pending.append((name, Segment(value)))

    def _put(self, signal: Signal, segment: Segment) -> None:
        if signal.is_missing:
            signal.is_missing = False
            self._note_missing()
        self._renew(signal, list(self._checked(segment, signal.count, signal.name)))

    def _checked(self, segment: Segment, count: int, name: str = "") -> Sequence[float]:
        """Its coefficients. Raises ModelError for one that would be lost."""
        if any(segment[count:]):
            received = f"input {name!r} received" if name else "received"
            degree = max(power for power in range(4) if segment[power] != 0.0)
            raise ModelError(
                f"{self.path}: {received} a segment of degree {degree}; expected {count} "
                f"coefficients: give the block that feeds it order={count}"
            )
        return segment[:count]

    def _note_missing(self) -> None:
        self._has_missing = any(each.is_missing for each in self.signals.values())

    def _renew(self, signal: Signal, coefficients: list[float]) -> None:
        signal.coefficients, signal.at = coefficients, self._at
        for number in signal.functions:
            self._due_functions[number] = -1
        for number in signal.crossings:
            self._due_crossings[number] = -1

    def _change_exact(self, name: str) -> None:
        for number in self.exact_signals[name].crossings:
            self._due_crossings[number] = -1
        if name in self._state_ports:
            self._send(name, self._state_ports, self.states[name].segment_at(self._at))

    def _send(
        self, name: str, ports: Mapping[str, OutPort[Segment]], coefficients: Sequence[float]
    ) -> None:
        port = ports.get(name)
        if port is not None and port.leads_somewhere:
            self._pending.append((port.name, Segment(*coefficients)))


def _copied(value: Any) -> Any:  # noqa: ANN401 -- a number, or lists of them
    if isinstance(value, list):
        return [_copied(each) for each in value]
    if isinstance(value, dict):
        return {key: _copied(each) for key, each in value.items()}
    return value
