"""From a `System` to a model: one engine, and the sources and delays that it is wired to."""

import ast
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import partial
from typing import Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.engine import Engine
from firmware_runtime.models.qss.expression import (
    DELAY,
    TIME,
    ExpressionError,
    names_of,
    parse,
)
from firmware_runtime.models.qss.methods import METHODS, State
from firmware_runtime.models.qss.program import (
    Layout,
    Quanta,
    compile_allowance,
    compile_expression,
)
from firmware_runtime.models.qss.sampling import SegmentDelay
from firmware_runtime.models.qss.segment import Segment
from firmware_runtime.models.qss.system import System

_HORIZON_S: Final = 100.0
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
        self.engine = self.add(Engine("engine", is_inner=True))
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
        """How many polynomials of q there have been after each state's first."""
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
        tree, system = self._delayed(self.system.tree_of(text), text), self.system
        signals = self.engine.signals
        counts = {each: signals[each].count for each in names_of(tree) if each in signals}
        quanta = {each: self._quanta[each] for each in counts if each in self._quanta}
        horizon_s = _HORIZON_S if system.horizon_s is None else system.horizon_s
        absolute, relative = self._quanta[name]
        allowed = Quanta(quanta, absolute / horizon_s, relative)
        self.engine.add_function(
            f"{name}'",
            ast.unparse(tree),
            name,
            order=self.states[name].order,
            tolerance=compile_allowance(tree, Layout(counts, system.parameters), allowed),
            parameters=system.parameters,
            quanta=quanta,
        )

    def output(self, text: str) -> ast.expr:
        """The tree of an expression that is read at instants; its delays are of exact states."""
        with self._faults_of("outputs"):
            return self._delayed(self.system.tree_of(text), text, exact=True)

    def _delayed(self, tree: ast.expr, text: str, *, exact: bool = False) -> ast.expr:
        """Put a delay block, and the name of its wire, in the place of each `delay(...)`."""
        model = self

        class _Delays(ast.NodeTransformer):
            def visit_Call(self, node: ast.Call) -> ast.expr:
                self.generic_visit(node)
                if isinstance(node.func, ast.Name) and node.func.id == DELAY:
                    return model._delay(node, text, exact=exact)
                return node

        changed: ast.expr = _Delays().visit(tree)
        return changed

    def _delay(self, node: ast.Call, text: str, *, exact: bool) -> ast.expr:
        try:
            if not 2 <= len(node.args) <= 3:
                raise ExpressionError(ast.unparse(node))
            signal, duration_s, *before = node.args
            known = {*self.engine.signals, *self.system.inputs}
            if not isinstance(signal, ast.Name) or signal.id not in known:
                raise ExpressionError(ast.unparse(node))
            numbers = [self._number(each) for each in (duration_s, *before)]
            if numbers[0] < 0.0:
                raise ExpressionError(f"{numbers[0]} s")
        except ValueError as error:
            expected = "expected delay(NAME, SECONDS) or delay(NAME, SECONDS, VALUE BEFORE)"
            raise ConfigError(self.name, [f"{text!r}: {error}; {expected}"]) from error
        return self._delay_of(signal.id, *numbers, exact=exact)

    def _delay_of(
        self, signal: str, duration_s: float, before: float | None = None, *, exact: bool
    ) -> ast.expr:
        sine = self.system.sine(signal)
        if before is None:
            known = {**self.system.states, **self.system.discrete}
            before = known.get(signal, 0.0)
        if sine is not None:
            then = f"{TIME} - {duration_s!r}"
            return parse(f"{sine.at(then)} if {then} >= 0 else {before!r}")
        exact = exact and signal in self.states
        wire = self.exact(signal) if exact else self._wire(signal)
        name = f"{signal}_{len(self.components)}_delayed"
        block = self.add(SegmentDelay(name, round(duration_s * SECOND), before))
        self.couple(wire, block.entrance)
        count = (self.engine.exact_signals if exact else self.engine.signals)[signal].count
        self.couple(block.out, self.engine.add_input(name, count))
        if signal in self._quanta:
            self._quanta[name] = self._quanta[signal]
        return ast.Name(name)

    def _wire(self, signal: str) -> OutPort[Segment]:
        wires = self.engine.out_ports
        if signal in wires:
            return wires[signal]
        source = self.components[signal]
        port: OutPort[Segment] = source.out_ports["out" if "out" in source.out_ports else "delayed"]
        return port

    def _number(self, tree: ast.expr) -> float:
        layout = Layout({}, self.system.parameters)
        return float(compile_expression(tree, layout, 1).value(0.0, [], [])[0])

    # Events --------------------------------------------------------------------------------------

    def _event(self, number: int) -> None:
        event, parameters = self.system.events[number], self.system.parameters
        text, direction = event.crossing()
        crossed = self._put_in(text)
        values = {name: self._put_in(text) for name, text in event.values.items()}
        only_if = None if event.only_if is None else self._put_in(event.only_if)
        self.engine.add_event(
            f"when {number + 1}",
            crossed,
            parameters,
            self.engine.setting(f"then {number + 1}", values, parameters, only_if),
            direction=direction,
            at_zero=not event.is_strict(),
        )

    def _put_in(self, text: str) -> str:
        return ast.unparse(self._delayed(self.system.tree_of(text), text))
