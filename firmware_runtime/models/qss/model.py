"""From a `System` to a coupled model: an integrator a state, a function an equation, and so on."""

import ast
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from typing import Any, Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.allowance import Quanta, compile_allowance
from firmware_runtime.models.qss.assignment import Assignment, Held
from firmware_runtime.models.qss.crossing import Crossing
from firmware_runtime.models.qss.expression import (
    DELAY,
    TIME,
    ExpressionError,
    names_of,
    parse,
)
from firmware_runtime.models.qss.function import Function
from firmware_runtime.models.qss.integrator import Integrator
from firmware_runtime.models.qss.program import Layout, compile_expression
from firmware_runtime.models.qss.sampling import SegmentDelay
from firmware_runtime.models.qss.segment import Segment
from firmware_runtime.models.qss.system import System

_HORIZON_S: Final = 100.0
_OF_A_SOURCE: Final = 3
"""How many coefficients a source may send."""


class SystemModel(Coupled):
    """The blocks of a system, wired.

    Its output ports are the quantized states, its input ports set the discrete variables.

    `integrators` and `held` hold the blocks of states and discrete variables by name.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system.name)
        self.system = system
        self._horizon_s = _HORIZON_S if system.horizon_s is None else system.horizon_s
        self._order = system.integrator.order
        self.wires: dict[str, OutPort[Segment]] = {}
        """What carries each state (quantized), discrete variable, input and delayed signal."""
        self._quanta: dict[str, tuple[float, float]] = {}
        self._counts: dict[str, int] = {}
        self._initial: dict[str, float] = {}
        self.integrators = {name: self._integrator(name) for name in system.states}
        self.held = {name: self._held(name) for name in system.discrete}
        self._add_inputs()
        for name, text in system.equations.items():
            with self._faults_of(f"equations: {name}"):
                self._equation(name, text)
        for number in range(len(system.events)):
            with self._faults_of(f"events: {number + 1}"):
                self._event(number)

    @property
    def steps(self) -> int:
        """How many segments its integrators have sent after the first."""
        return sum(max(each.steps - 1, 0) for each in self.integrators.values())

    @contextmanager
    def _faults_of(self, where: str) -> Iterator[None]:
        """Say of which part of the system it is what cannot be compiled."""
        try:
            yield
        except ExpressionError as error:
            raise ConfigError(self.name, [f"{where}: {error}"]) from error

    def _integrator(self, name: str) -> Integrator:
        system = self.system
        width = system.quantum_of(name), system.relative_quantum_of(name)
        block = self.add(
            system.integrator(name, system.states[name], width[0], relative_quantum=width[1])
        )
        self._wire(name, block.out, self._order, system.states[name])
        self._quanta[name] = width
        port = self.out_port(name, Segment)
        self.couple(block.out, port)
        return block

    def _held(self, name: str) -> Held:
        block = self.add(Held(name, self.system.discrete[name]))
        self.couple(self.in_port(name, Segment), block.set)
        self._wire(name, block.out, 1, block.value)
        return block

    def _add_inputs(self) -> None:
        for name, source in self.system.inputs.items():
            if self.system.sine(name) is not None:
                continue
            block = deepcopy(source)
            block.name = name
            self.add(block)
            self._wire(name, block.out_ports["out"], _OF_A_SOURCE, 0.0)

    def _wire(self, name: str, port: OutPort[Segment], count: int, initial: float) -> None:
        self.wires[name], self._counts[name], self._initial[name] = port, count, initial

    # Equations ----------------------------------------------------------------------------------

    def _equation(self, name: str, text: str) -> None:
        derivative = self.integrators[name].derivative
        tree = self._delayed(self.system.tree_of(text), text)
        is_wire = isinstance(tree, ast.Name) and self._counts.get(tree.id, 9) <= self._order
        if isinstance(tree, ast.Name) and is_wire and tree.id != name:
            self.couple(self.wires[tree.id], derivative)
            return
        block = self.add(self._function(f"{name}'", tree, self._quanta[name]))
        self._feed(block.inputs)
        self.couple(block.out, derivative)

    def _function(self, name: str, tree: ast.expr, width: tuple[float, float]) -> Function:
        """A function whose error is allowed what the quanta of its inputs cause anyway."""
        inputs = [each for each in names_of(tree) if each in self.wires]
        counts = {each: self._counts[each] for each in inputs}
        horizon_s, parameters = self._horizon_s, self.system.parameters
        quanta = {each: self._quanta[each] for each in inputs if each in self._quanta}
        allowed = Quanta(quanta, width[0] / horizon_s, width[1])
        return Function(
            name,
            ast.unparse(tree),
            inputs,
            order=self._order,
            tolerance=compile_allowance(tree, Layout(counts, parameters), allowed),
            parameters=parameters,
            counts=counts,
            quanta=quanta,
        )

    def _feed(self, ports: dict[str, InPort[Segment]], *, exact: bool = False) -> None:
        for name, port in ports.items():
            wire = self.wires[name]
            if exact and name in self.integrators:
                self.integrators[name].sends_state = True
                wire = self.integrators[name].state
            self.couple(wire, port)

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
            known = {*self.wires, *self.system.inputs}
            if not isinstance(signal, ast.Name) or signal.id not in known:
                raise ExpressionError(ast.unparse(node))
            numbers = [self._number(each) for each in (duration_s, *before)]
            if numbers[0] < 0.0:
                raise ExpressionError(f"{numbers[0]} s")
        except ValueError as error:
            expected = "expected delay(NAME, SECONDS) or delay(NAME, SECONDS, VALUE BEFORE)"
            raise ConfigError(self.name, [f"{text!r}: {error}; {expected}"]) from error
        initial = numbers[1] if before else self._initial.get(signal.id, 0.0)
        sine = self.system.sine(signal.id)
        if sine is not None:
            then = f"{TIME} - {numbers[0]!r}"
            return parse(f"{sine.at(then)} if {then} >= 0 else {initial!r}")
        name = f"{signal.id}_{len(self.components)}_delayed"
        block = self.add(SegmentDelay(name, round(numbers[0] * SECOND), initial))
        self._wire(name, block.out, self._counts[signal.id], initial)
        if signal.id in self._quanta:
            self._quanta[name] = self._quanta[signal.id]
        self._feed({signal.id: block.entrance}, exact=exact)
        return ast.Name(name)

    def _number(self, tree: ast.expr) -> float:
        layout = Layout({}, self.system.parameters)
        return float(compile_expression(tree, layout, 1).value(0.0, [], [])[0])

    # Events -------------------------------------------------------------------------------------

    def _event(self, number: int) -> None:
        event, system = self.system.events[number], self.system
        text, direction = event.crossing()
        crossed = self._put_in(text)
        options: dict[str, Any] = {"parameters": system.parameters, "counts": self._exact_counts()}
        crossing = self.add(
            Crossing(
                f"when {number + 1}",
                crossed,
                self._names(crossed),
                direction=direction,
                at_zero=not event.is_strict(),
                **options,
            )
        )
        self._feed(crossing.inputs, exact=True)
        values = {name: self._put_in(text) for name, text in event.values.items()}
        only_if = None if event.only_if is None else self._put_in(event.only_if)
        read = self._names(*values.values(), *([] if only_if is None else [only_if]))
        then = self.add(Assignment(f"then {number + 1}", values, read, only_if=only_if, **options))
        self.couple(crossing.event, then.trigger)
        self._feed(then.inputs, exact=True)
        for name, port in then.outputs.items():
            target = self.held[name].set if name in self.held else self.integrators[name].reset
            self.couple(port, target)

    def _put_in(self, text: str) -> str:
        return ast.unparse(self._delayed(self.system.tree_of(text), text))

    def _names(self, *texts: str) -> list[str]:
        trees = (ast.parse(text, mode="eval").body for text in texts)
        found = dict.fromkeys(name for tree in trees for name in names_of(tree))
        return [name for name in found if name in self.wires]

    def _exact_counts(self) -> dict[str, int]:
        """With the integrators' wires `state`, which bring one coefficient more."""
        return {
            name: count + 1 if name in self.integrators else count
            for name, count in self._counts.items()
        }
