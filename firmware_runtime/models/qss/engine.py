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

import ast
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import partial
from math import isfinite
from typing import Any, Final, NamedTuple, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.models.qss.crossing import Crossing
from firmware_runtime.models.qss.expression import names_of
from firmware_runtime.models.qss.function import Function
from firmware_runtime.models.qss.methods import State
from firmware_runtime.models.qss.program import Program, compile_expression
from firmware_runtime.models.qss.segment import NANO, Readings, Segment, Signal
from firmware_runtime.models.qss.watch import worth

_MOST_ROUNDS: Final = 10_000
"""So many rounds at one instant are a livelock."""

Setting: TypeAlias = Mapping[str, tuple[Program, Readings]]
"""What an event sets, by name; by the name "" the condition on which it does."""


class _Event(NamedTuple):
    crossing: Crossing
    setting: Setting
    event: OutPort[bool] | None
    side: OutPort[Segment] | None


class Engine(Atomic):
    """One quantized system; its parts are added before it runs.

    idle (until a part is due) --> sending (0) --what has changed!--> idle; --any port?--> sending

    `signals` are what equations read, by name: inputs, discrete values, quantized states. Events
    read `exact_signals`, with the exact states in their place.
    """

    def __init__(
        self, name: str, parameters: Mapping[str, float] | None = None, *, is_inner: bool = False
    ) -> None:
        super().__init__(name)
        self._parameters = parameters or {}
        self.signals: dict[str, Signal] = {}
        self.exact_signals: dict[str, Signal] = {}
        self.states: dict[str, State] = {}
        self._is_inner = is_inner
        self._has_missing = False
        self._at = 0
        self._entrances: list[tuple[InPort[Any], Callable[[Any], None]]] = []
        self._functions: list[tuple[Function, Callable[[Sequence[float]], None]]] = []
        """With what takes their results."""
        self._events: list[_Event] = []
        self._due_states: list[int] = [NEVER]
        self._due_functions: list[int] = [NEVER]
        self._due_events: list[int] = [NEVER]
        self._pending: list[tuple[str, Any]] = []

    # Parts ---------------------------------------------------------------------------------------

    def path_of(self, part: str) -> str:
        """Return where a part is, for errors."""
        if self._is_inner and self.parent is not None:
            return f"{self.parent.path}.{part}"
        return self.path

    def add_input(
        self, name: str, count: int, initial: float | None = None, port: str | None = None
    ) -> InPort[Segment]:
        """A signal that comes by a port, in so many coefficients."""
        signal = self._add_signal(Signal(name, count, initial))
        return self.take(self.in_port(port or name, Segment), partial(self._put, signal))

    def add_held(self, name: str, initial: float, way: OutPort[Segment]) -> None:
        """A value that changes at events only, and is sent then."""
        self._add_signal(Signal(name, 1, initial, way))

    def add_state(self, name: str, state: State, way: OutPort[Segment]) -> None:
        """A quantized state, as yet without a derivative; q is sent whenever it is renewed."""
        self.signals[name], self.exact_signals[name] = state.quantized, state.exact
        state.quantized.way = way
        self.states[name] = state
        self._due_states.insert(-1, 0)

    def _add_signal(self, signal: Signal) -> Signal:
        self.signals[signal.name] = self.exact_signals[signal.name] = signal
        self._has_missing |= signal.is_missing
        return signal

    def add_function(
        self,
        name: str,
        tree: ast.expr,
        target: str | OutPort[Segment],
        **options: Any,  # noqa: ANN401 -- those of `Function`
    ) -> None:
        """The derivative of a state, by its name, or what is sent."""
        readings = self._readings(name, tree, self.signals)
        for signal in readings.signals:
            signal.functions.append(len(self._functions))
        if isinstance(target, str):
            deliver = partial(self._derive, *self._numbered(target))
        else:
            deliver = partial(self._send, target)
        self._functions.append((Function(readings, tree, **options), deliver))
        self._due_functions.insert(-1, 0)

    def add_event(
        self,
        name: str,
        tree: ast.expr,
        setting: Setting | None = None,
        *,
        event: OutPort[bool] | None = None,
        side: OutPort[Segment] | None = None,
        **options: Any,  # noqa: ANN401 -- those of `Crossing`
    ) -> None:
        """Add what happens where an expression of exact states crosses zero."""
        readings = self._readings(name, tree, self.exact_signals)
        for signal in readings.signals:
            signal.events.append(len(self._events))
        crossing = Crossing(readings, tree, **options)
        self._events.append(_Event(crossing, setting or {}, event, side))
        self._due_events.insert(-1, 0)

    def setting(
        self,
        name: str,
        values: Mapping[str, ast.expr],
        only_if: ast.expr | None = None,
    ) -> Setting:
        """Expressions for states, discrete values or ports, and a condition."""
        condition = {}
        if only_if is not None:
            condition[""] = ast.IfExp(only_if, ast.Constant(1.0), ast.Constant(0.0))
        setting = {}
        for target, tree in {**condition, **values}.items():
            readings = self._readings(name, tree, self.exact_signals)
            program = compile_expression(tree, readings.layout, 1)
            setting[target] = program, readings
        return setting

    def _readings(self, name: str, tree: ast.expr, signals: Mapping[str, Signal]) -> Readings:
        read = [signals[each] for each in names_of(tree) if each in signals]
        return Readings(partial(self.path_of, name), tree, read, self._parameters)

    def take(self, port: InPort[Any], action: Callable[[Any], None]) -> InPort[Any]:
        """Let an action take the last value that a port has got."""
        self._entrances.append((port, action))
        return port

    # The DEVS functions --------------------------------------------------------------------------

    def initialize(self) -> None:
        """Begin at once."""
        for signal in self.signals.values():
            if signal.way is not None and signal.name not in self.states:
                self._pending.append((signal.way.name, Segment(*signal.coefficients)))
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
        for port, action in self._entrances:
            if port:
                action(port[-1])
        self._settle()

    def confluent(self) -> None:
        """Take inputs in before what is due now is worked off."""
        self._at += self.sigma
        self._pending = []
        self.external(0)

    def state(self) -> dict[str, Any]:
        """Return what changes, as plain values."""
        return {
            "parts": [
                {key: deepcopy(getattr(part, key)) for key in part.kept} for part in self._parts
            ],
            "due": deepcopy([self._due_states, self._due_functions, self._due_events]),
            "own": [self._at, self.phase, self.sigma, [list(each) for each in self._pending]],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        for part, values in zip(self._parts, state["parts"], strict=True):
            for key, value in values.items():
                setattr(part, key, deepcopy(value))
        self._due_states, self._due_functions, self._due_events = deepcopy(state["due"])
        self._at, self.phase, self.sigma, pending = state["own"]
        self._pending = [tuple(each) for each in pending]
        self._note_missing()

    @property
    def _parts(self) -> list[Any]:
        functions = [each for each, _ in self._functions]
        crossings = [each.crossing for each in self._events]
        watches = [each.watch for each in functions] + [each.watch for each in crossings]
        states = self.states.values()
        own = [*self.signals.values(), *(each.exact for each in states), *states]
        return [*own, *functions, *crossings, *watches]

    # One instant ---------------------------------------------------------------------------------

    def _settle(self) -> None:
        now = self._at
        states, functions, events = self._due_states, self._due_functions, self._due_events
        for _ in range(_MOST_ROUNDS):
            while (state_due := min(states)) <= now:
                self._requantize(states.index(state_due))
            while (function_due := min(functions)) <= now:
                self._evaluate(functions.index(function_due))
            state_due = min(states)
            if state_due <= now:
                continue
            happened = []
            while (event_due := min(events)) <= now:
                number = events.index(event_due)
                if self._look(number):
                    happened.append(number)
            if not happened:
                break
            self._happen([self._events[number].setting for number in sorted(happened)])
        else:
            raise ModelError(
                f"{_MOST_ROUNDS} rounds at {format_time(now)}",
                where=self.path,
                expected="steps and events that do not cause each other without end",
            )
        due = now if self._pending else min(state_due, function_due, event_due)
        self.sigma = NEVER if due >= NEVER else due - now

    def _requantize(self, number: int) -> None:
        state = list(self.states.values())[number]
        self._due_states[number] = state.requantize(self._at)
        self._announce(state.quantized)
        if state.steps == 1:
            self._announce(state.exact)

    def _evaluate(self, number: int) -> None:
        function, deliver = self._functions[number]
        if self._has_missing and function.readings.are_missing:
            self._due_functions[number] = NEVER
            return
        is_continuous = self._due_functions[number] >= 0
        result, due = function.evaluate(self._at, is_continuous=is_continuous)
        self._due_functions[number] = due
        deliver(result)

    def _derive(self, number: int, state: State, derivative: Sequence[float]) -> None:
        self._due_states[number] = state.derive(self._at, derivative)
        self._announce(state.exact)

    def _look(self, number: int) -> bool:
        """Return whether the event of this number happens."""
        crossing, _, event, side = self._events[number]
        if self._has_missing and crossing.readings.are_missing:
            self._due_events[number] = NEVER
            return False
        was = crossing.side
        happens, self._due_events[number] = crossing.look(self._at)
        if crossing.side is not was:
            self._send(side, [1.0 if crossing.side else 0.0])
        if event is not None and happens:
            self._pending.append((event.name, bool(crossing.side)))
        return happens

    def _happen(self, settings: Sequence[Setting]) -> None:
        """Evaluate all before any is made; the last one counts."""
        values: dict[str, float] = {}
        for setting in settings:
            found = {}
            for name, (program, readings) in setting.items():
                found[name] = self._worth(program, readings)
                if name == "" and found.pop(name) == 0.0:
                    break
            values |= found
        for name, value in values.items():
            self._set(name, value)

    def _worth(self, program: Program, readings: Readings) -> float:
        try:
            value = worth(program, self._at * NANO, readings.at(self._at))
            if not isfinite(value):
                raise OverflowError(f"it is {value}")
        except (ValueError, ArithmeticError) as error:
            raise readings.no_value(self._at, error) from error
        return value

    # Changes -------------------------------------------------------------------------------------

    def _set(self, name: str, value: float) -> None:
        if name in self.states:
            number, state = self._numbered(name)
            self._due_states[number] = state.reset(self._at, value)
            self._announce(state.exact)
        elif name in self.signals:
            self._renew(self.signals[name], [value])
        else:
            self._send(self.out_ports[name], [value])

    def set_by(self, name: str, segment: Segment) -> None:
        """Take the value of a state or a discrete value from a port."""
        self._set(name, segment[0])

    def _trigger(self, setting: Setting, _: object) -> None:
        """Take whatever comes by a port for an event."""
        self._happen([setting])

    def derive_by(self, name: str, segment: Segment) -> None:
        """Take the derivative of a state from a port."""
        number, state = self._numbered(name)
        self._derive(number, state, self._checked(segment, state.order, "derivative"))

    def _put(self, signal: Signal, segment: Segment) -> None:
        if signal.is_missing:
            signal.is_missing = False
            self._note_missing()
        self._renew(signal, list(self._checked(segment, signal.count, signal.name)))

    def _checked(self, segment: Segment, count: int, name: str) -> Sequence[float]:
        """Its coefficients. Raises ModelError for one that would be lost."""
        if any(segment[count:]):
            degree = max(power for power in range(4) if segment[power] != 0.0)
            raise ModelError(
                f"input {name!r} received a segment of degree {degree}",
                where=self.path,
                expected=f"{count} coefficients: give the block that feeds it order={count}",
            )
        return segment[:count]

    def _note_missing(self) -> None:
        self._has_missing = any(each.is_missing for each in self.signals.values())

    def _numbered(self, name: str) -> tuple[int, State]:
        return list(self.states).index(name), self.states[name]

    def _renew(self, signal: Signal, coefficients: list[float]) -> None:
        signal.coefficients, signal.at = coefficients, self._at
        self._announce(signal)

    def _announce(self, signal: Signal) -> None:
        """Let those that read a signal see that it is new, and send it."""
        for number in signal.functions:
            self._due_functions[number] = -1
        for number in signal.events:
            self._due_events[number] = -1
        if signal.way is not None:
            self._send(signal.way, signal.coefficients)

    def _send(self, way: OutPort[Segment] | None, coefficients: Sequence[float]) -> None:
        if way is not None and way.leads_somewhere:
            self._pending.append((way.name, Segment(*coefficients)))
