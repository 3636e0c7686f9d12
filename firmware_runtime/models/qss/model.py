"""A `System` as a model, one engine wired to its sources and delays, and its solution."""

import ast
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from functools import partial
from numbers import Integral, Real
from typing import Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import LONGEST_S, SECOND
from firmware_runtime.devs.time import seconds as whole_ns
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.engine import Engine
from firmware_runtime.models.qss.expression import TIME, ExpressionError, names_of, parse
from firmware_runtime.models.qss.methods import METHODS, State
from firmware_runtime.models.qss.program import Layout, Quanta, compile_expression
from firmware_runtime.models.qss.sampling import SegmentDelay
from firmware_runtime.models.qss.segment import NANO, Segment, is_finite
from firmware_runtime.models.qss.system import System
from firmware_runtime.models.qss.watch import worth

_OF_A_SOURCE: Final = 3
"""How many coefficients a source may send."""


class SystemModel(Coupled):
    """A system as a model: its engine, with its sources and delays around it.

    Its output ports are the quantized states and the discrete values, its input ports set the
    discrete values; `exact(name)` is a port that carries the exact state; `states` are by name.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system.name)
        self.system = system
        self.engine = self.add(Engine("engine", system.parameters, is_inner=True))
        self._quanta: dict[str, tuple[float, float]] = {}
        """Of each state, and of what is delayed of one."""
        for name in system.states:
            self._add_state(name)
        for name, value in system.discrete.items():
            self._add_discrete(name, value)
        self._add_inputs()
        for name, text in system.equations.items():
            with self._faults_of(f"equations: {name}"):
                self._equation(name, text)
        for number in range(len(system.events)):
            with self._faults_of(f"events: {number + 1}"):
                self._event(number)

    @property
    def states(self) -> dict[str, State]:
        """The quantized states."""
        return self.engine.states

    @property
    def steps(self) -> int:
        """Number of polynomials of q there have been after each state's first."""
        return sum(max(each.steps - 1, 0) for each in self.states.values())

    def exact(self, name: str) -> OutPort[Segment]:
        """The port that carries a state's exact polynomial; declared before the model is run."""
        signal = self.engine.exact_signals[name]
        if signal.way is None:
            signal.way = self.engine.out_port(f"{name} exact", Segment)
        return signal.way

    @contextmanager
    def _faults_of(self, where: str) -> Iterator[None]:
        """Say of which part of the system it is what cannot be compiled."""
        try:
            yield
        except ExpressionError as error:
            raise ConfigError(self.name, [f"{where}: {error}"]) from error

    # Signals -------------------------------------------------------------------------------------

    def _add_state(self, name: str) -> None:
        system = self.system
        width = self._quanta[name] = system.quantum_of(name), system.relative_quantum_of(name)
        path = partial(self.engine.path_of, name)
        state = METHODS[system.method](name, path, system.states[name], *width)
        self.engine.add_state(name, state, self._way(name))

    def _add_discrete(self, name: str, value: float) -> None:
        self.engine.add_held(name, value, self._way(name))
        setter = self.engine.in_port(f"set {name}", Segment)
        self.engine.take(setter, partial(self.engine.set_by, name))
        self.couple(self.in_port(name, Segment), setter)

    def _way(self, name: str) -> OutPort[Segment]:
        wire = self.engine.out_port(name, Segment)
        self.couple(wire, self.out_port(name, Segment))
        return wire

    def _add_inputs(self) -> None:
        for name, source in self.system.inputs.items():
            if self.system.sine(name) is None:
                block = deepcopy(source)
                block.name = name
                self.add(block)
                self.couple(block.out_ports["out"], self.engine.add_input(name, _OF_A_SOURCE))

    # Equations -----------------------------------------------------------------------------------

    def _equation(self, name: str, text: str) -> None:
        tree, (absolute, relative) = self._tree(text), self._quanta[name]
        allowed = Quanta(self._quanta, absolute / self.system.horizon_s, relative)
        order = self.states[name].order
        self.engine.add_function(f"{name}'", tree, name, order=order, tolerance=allowed)

    def output(self, text: str) -> ast.expr:
        """The tree of an expression that is read at instants; its delays are of exact states."""
        with self._faults_of("outputs"):
            return self._tree(text, exact=True)

    def _event(self, number: int) -> None:
        event = self.system.events[number]
        text, direction, at_zero = event.crossing()
        values = {name: self._tree(text) for name, text in event.values.items()}
        only_if = None if event.only_if is None else self._tree(event.only_if)
        self.engine.add_event(
            f"when {number + 1}",
            self._tree(text),
            self.engine.setting(f"then {number + 1}", values, only_if),
            direction=direction,
            at_zero=at_zero,
        )

    def _tree(self, text: str, *, exact: bool = False) -> ast.expr:
        """An expression, with the names of delayed signals in the place of each `delay(...)`."""
        return self.system.tree_of(text, partial(self._delayed, text, exact=exact))

    # Delays --------------------------------------------------------------------------------------

    def _delayed(self, text: str, node: ast.Call, *, exact: bool) -> ast.expr:
        try:
            signal, duration_s, *before = node.args
            if not isinstance(signal, ast.Name) or len(before) > 1:
                raise ExpressionError(ast.unparse(node))
            if signal.id not in {*self.engine.signals, *self.system.inputs}:
                raise ExpressionError(ast.unparse(node))
            numbers = [self._number(each) for each in (duration_s, *before)]
            if numbers[0] < 0.0:
                raise ExpressionError(f"{numbers[0]} s")
        except ValueError as error:
            expected = "expected delay(NAME, SECONDS) or delay(NAME, SECONDS, VALUE BEFORE)"
            raise ConfigError(self.name, [f"{text!r}: {error}; {expected}"]) from error
        return self._delay_of(signal.id, *numbers, exact=exact)

    def _delay_of(
        self, name: str, duration_s: float, before: float | None = None, *, exact: bool
    ) -> ast.expr:
        if before is None:
            before = {**self.system.states, **self.system.discrete}.get(name, 0.0)
        sine = self.system.sine(name)
        if sine is not None:
            then = f"{TIME} - {duration_s!r}"
            return parse(f"{sine.at(then)} if {then} >= 0 else {before!r}")
        exact = exact and name in self.states
        signal = (self.engine.exact_signals if exact else self.engine.signals)[name]
        delayed = f"{name}_{len(self.components)}_delayed"
        block = self.add(SegmentDelay(delayed, round(duration_s * SECOND), before))
        self.couple(self.exact(name) if exact else self._wire(name), block.entrance)
        self.couple(block.out, self.engine.add_input(delayed, signal.count))
        if name in self._quanta:
            self._quanta[delayed] = self._quanta[name]
        return ast.Name(delayed)

    def _wire(self, name: str) -> OutPort[Segment]:
        if name in self.engine.out_ports:
            return self.engine.out_ports[name]
        ports = self.components[name].out_ports
        return ports["out" if "out" in ports else "delayed"]

    def _number(self, tree: ast.expr) -> float:
        if TIME in names_of(tree):
            raise ExpressionError(f"{ast.unparse(tree)} changes with time")
        layout = Layout({}, self.system.parameters)
        number = float(compile_expression(tree, layout, 1).value(0.0, [], [])[0])
        if not is_finite(number):
            raise ExpressionError(f"{ast.unparse(tree)} is {number}")
        return number


_MOST_SAMPLES: Final = 10_000_000
"""More fill the memory before anything is solved."""


class Simulation:
    """A system under way; `advance` brings it to an instant, `values` are its outputs there."""

    def __init__(self, system: System, *, checked: bool = False) -> None:
        self.system = system
        self.model = SystemModel(system)
        trees = {text: self.model.output(text) for text in system.shown}
        self.simulator = Simulator(self.model, checked=checked)
        self.now = 0
        signals = self.model.engine.exact_signals
        self._outputs = {}
        for text, tree in trees.items():
            read = [signals[name] for name in names_of(tree) if name in signals]
            layout = Layout({each.name: 1 for each in read}, system.parameters)
            self._outputs[text] = compile_expression(tree, layout, 1), read

    def advance(self, until: int) -> None:
        """Work off everything up to an instant, in ns."""
        self.simulator.run(until)
        self.now = until

    @property
    def values(self) -> dict[str, float]:
        """The outputs now, by their expressions."""
        now = self.now
        return {
            text: worth(program, now * NANO, [each.segment_at(now)[0] for each in read])
            for text, (program, read) in self._outputs.items()
        }


def solve(
    system: System,
    until: float | None = None,
    *,
    samples: int = 1001,
    times: Sequence[float] | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> tuple[list[float], dict[str, list[float]]]:
    """Times in s and, by output, the values then: `samples` of them evenly spread, or at `times`.

    The values are those of the states' polynomials, not interpolated. `progress` is called with how
    many instants are done. Raises ConfigError for times that do not ascend from 0 on; ModelError
    where the equations cannot be gone on with.
    """
    if not isinstance(system, System):
        raise ConfigError.of_one("solve", f"{system!r}", expected="a System")
    at = [float(each) for each in times] if times is not None else _spread(until, samples)
    instants = [whole_ns(each) for each in at]
    if instants != sorted(instants) or any(each < 0 for each in instants):
        raise ConfigError.of_one("solve", "times do not ascend", expected="instants from 0 s on")
    simulation = Simulation(system)
    values: dict[str, list[float]] = {text: [] for text in system.shown}
    for done, instant in enumerate(instants, 1):
        simulation.advance(instant)
        for text, value in simulation.values.items():
            values[text].append(value)
        progress(done)
    return at, values


def _spread(until: float | None, samples: int) -> list[float]:
    is_sound = isinstance(until, Real) and 0.0 < until <= LONGEST_S
    is_count = isinstance(samples, Integral) and 2 <= samples <= _MOST_SAMPLES
    if until is None or not is_sound or not is_count:
        expected = f"expected more than 0 s, {LONGEST_S:g} s at most, 2 to {_MOST_SAMPLES} samples"
        fault = f"until {until!r} s, {samples!r} samples; {expected}"
        raise ConfigError.of_one("solve", fault)
    return [float(until) * number / (samples - 1) for number in range(samples)]
