"""A system by its states' names and equations, as text: what becomes an engine.

System(
    states={"x": 1.0, "v": 0.0},
    equations={"x": "v", "v": "-9.81"},
    events=[When("x crosses 0 falling", v="-0.8 * v")],
)
"""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from keyword import iskeyword
from typing import Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.blocks import Sine
from firmware_runtime.models.qss.expression import (
    CONSTANTS,
    DELAY,
    FUNCTIONS,
    TIME,
    ExpressionError,
    names_of,
    parse,
)
from firmware_runtime.models.qss.methods import METHODS, RESOLUTION, quantum_faults
from firmware_runtime.models.qss.segment import is_finite
from firmware_runtime.models.qss.shape import shape_faults
from firmware_runtime.models.qss.when import When

_LEAST_QUANTUM: Final = 1e-100
"""Of a state that begins at 0."""
_TAKEN: Final = {*FUNCTIONS, *CONSTANTS, TIME, DELAY, "trigger"}
_NAME = re.compile(r"[A-Za-z]\w*")


@dataclass(frozen=True)
class System:
    """States, equations, and what else there is; raises ConfigError with every fault found.

    `equations` gives each state's derivative, in its unit by s. `t` is time in s. `definitions` are
    named expressions that others may use; `parameters` numbers; `discrete` values that change at
    events only; `inputs` sources by name, atomic models with a port `out`. In equations and
    definitions, `delay(x, 0.1)` is a state, a discrete variable or an input as it was 0.1 s before,
    and its initial value before the start; a third argument is another value before the start.

    `method` is QSS1, QSS2, QSS3 or LIQSS2. `quantum`, in the unit of each state, and
    `relative_quantum` are one number for all states or a mapping; the larger one counts. Within
    `horizon_s` the errors of functions cut off, of time above all, add up to less than a quantum;
    without one that is 100 s, however long one solves.
    """

    states: Mapping[str, float]
    equations: Mapping[str, str]
    method: str = "QSS2"
    quantum: float | Mapping[str, float] = 1e-3
    relative_quantum: float | Mapping[str, float] = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)
    discrete: Mapping[str, float] = field(default_factory=dict)
    definitions: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, Atomic] = field(default_factory=dict)
    events: Sequence[When] = ()
    outputs: Sequence[str] = ()
    name: str = "system"
    horizon_s: float | None = None

    def __post_init__(self) -> None:
        shape = list(shape_faults(self))
        if shape:
            raise ConfigError(self.name, shape)
        names, numbers = self._name_faults(), self._number_faults()
        faults = list(dict.fromkeys([*names, *self._equation_faults(), *numbers, *self._texts()]))
        if faults:
            raise ConfigError(self.name, faults)
        for name in ("states", "discrete", "parameters", "quantum", "relative_quantum"):
            object.__setattr__(self, name, _plain(getattr(self, name)))
        if self.horizon_s is not None:
            object.__setattr__(self, "horizon_s", float(self.horizon_s))

    def quantum_of(self, state: str) -> float:
        """The absolute quantum of a state."""
        return _of(self.quantum, state, 0.0)

    def relative_quantum_of(self, state: str) -> float:
        """The relative quantum of a state."""
        return _of(self.relative_quantum, state, 0.0)

    def tree_of(self, text: str) -> ast.expr:
        """An expression with its definitions put in. Raises ExpressionError."""
        return self._put_in(parse(text, {DELAY}), ())

    def sine(self, name: str) -> Sine | None:
        """An input that is put into expressions as a function of time, as it is exact there."""
        source = self.inputs.get(name)
        return source if type(source) is Sine else None

    @property
    def shown(self) -> Sequence[str]:
        """The outputs; without any, the states."""
        return self.outputs or list(self.states)

    # Faults -------------------------------------------------------------------------------------

    def _name_faults(self) -> Iterator[str]:
        known: dict[str, str] = {}
        groups = ("states", "discrete", "inputs", "definitions", "parameters")
        for group in groups:
            for name in getattr(self, group):
                if name in _TAKEN or iskeyword(name):
                    yield f"{group}: {name!r} has a meaning in expressions; expected another name"
                elif not _NAME.fullmatch(name):
                    yield f"{group}: {name!r} is no name; expected a letter, then letters or digits"
                if name in known:
                    yield f"{group}: {name!r} is one of {known[name]} too"
                known[name] = group

    def _equation_faults(self) -> Iterator[str]:
        yield from (
            f"equations: none for {name}" for name in sorted(self.states.keys() - self.equations)
        )
        yield from (
            f"equations: {name} is no state" for name in sorted(self.equations.keys() - self.states)
        )
        for name, source in self.inputs.items():
            if "out" not in getattr(source, "out_ports", {}):
                yield f"inputs: {name} is {source!r}; expected an atomic model with a port out"
        if not self.states:
            yield "states: none; expected one or more"

    def _number_faults(self) -> Iterator[str]:
        if self.method not in tuple(METHODS):  # a comparison: it may be of any kind
            yield f"method is {self.method!r}; expected one of {', '.join(METHODS)}"
        horizon_s = self.horizon_s
        if horizon_s is not None and not (is_finite(horizon_s) and horizon_s > 0.0):
            yield f"horizon_s is {self.horizon_s!r}; expected more than 0"
        for group in ("states", "discrete", "parameters"):
            for name, value in getattr(self, group).items():
                if not is_finite(value):
                    yield f"{group}: {name} is {value!r}; expected a finite number"
        yield from self._quantum_faults()

    def _quantum_faults(self) -> Iterator[str]:
        for group in ("quantum", "relative_quantum"):
            given = getattr(self, group)
            if isinstance(given, Mapping):
                yield from (f"{group}: {name} is no state" for name in given.keys() - self.states)
        for name in self.states:
            quantum, least = self.quantum_of(name), self._least_quantum(name)
            faults = list(quantum_faults(quantum, self.relative_quantum_of(name)))
            if not faults and quantum < least:
                faults = [f"quantum{{}} is {quantum!r}; expected {least:.1e} or more"]
            yield from (fault.format(f" of {name}") for fault in faults)

    def _least_quantum(self, name: str) -> float:
        """What a float resolves beside the initial value; nothing where a relative one counts."""
        initial, relative = self.states[name], self.relative_quantum_of(name)
        if not is_finite(initial) or (is_finite(relative) and relative > RESOLUTION):
            return 0.0
        return max(RESOLUTION * abs(initial), _LEAST_QUANTUM)

    def _texts(self) -> Iterator[str]:
        texts = [(f"equations: {name}", text) for name, text in self.equations.items()]
        texts += [(f"definitions: {name}", text) for name, text in self.definitions.items()]
        texts += [("outputs", text) for text in self.outputs]
        for number, event in enumerate(self.events, 1):
            yield from self._event_faults(f"events: {number}", event)
        for where, text in texts:
            yield from self._text_faults(where, text)

    def _event_faults(self, where: str, event: When) -> Iterator[str]:
        try:
            crossing, _ = event.crossing()
        except ExpressionError as error:
            yield f"{where}: {error}"
        else:
            yield from self._text_faults(where, crossing)
        for name, text in event.values.items():
            if name not in self.states and name not in self.discrete:
                yield f"{where}: {name} is neither a state nor discrete"
            yield from self._text_faults(where, text)
        if event.only_if is not None:
            yield from self._text_faults(where, event.only_if)

    def _text_faults(self, where: str, text: str) -> Iterator[str]:
        known = {*self.states, *self.discrete, *self.inputs, *self.parameters, TIME}
        try:
            tree = self.tree_of(text)
        except ExpressionError as error:
            yield f"{where}: {error}"
            return
        unknown = [name for name in names_of(tree) if name not in known]
        if unknown:
            yield f"{where}: {', '.join(unknown)} in {text!r} is not known"

    def _put_in(self, tree: ast.expr, above: tuple[str, ...]) -> ast.expr:
        system = self

        class _Definitions(ast.NodeTransformer):
            def visit_Call(self, node: ast.Call) -> ast.expr:
                signal = node.args[0] if _is_delay(node) and node.args else None
                self.generic_visit(node)
                if isinstance(signal, ast.Name) and system.sine(signal.id) is not None:
                    node.args[0] = signal
                return node

            def visit_Name(self, node: ast.Name) -> ast.expr:
                sine = system.sine(node.id)
                text = system.definitions.get(node.id) if sine is None else sine.at(TIME)
                if text is None:
                    return node
                if node.id in above:
                    raise ExpressionError(f"{node.id} is defined by itself")
                return system._put_in(parse(text, {DELAY}), (*above, node.id))

        changed: ast.expr = _Definitions().visit(tree)
        return changed


def _is_delay(node: ast.Call) -> bool:
    return isinstance(node.func, ast.Name) and node.func.id == DELAY


def _of(given: float | Mapping[str, float], name: str, otherwise: float) -> float:
    return given.get(name, otherwise) if isinstance(given, Mapping) else given


def _plain(given: float | Mapping[str, float]) -> float | dict[str, float]:
    """Floats in place of numbers of other kinds, such as numpy's."""
    if isinstance(given, Mapping):
        return {name: float(value) for name, value in given.items()}
    return float(given)
