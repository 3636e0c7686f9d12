"""A system by its states' names and equations, as text: what becomes an engine.

System(
    states={"x": 1.0, "v": 0.0},
    equations={"x": "v", "v": "-9.81"},
    events=[When("x crosses 0 falling", v="-0.8 * v")],
)
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from keyword import iskeyword
from typing import Final, cast

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.blocks import Sine
from firmware_runtime.models.qss.crossing import Direction
from firmware_runtime.models.qss.expression import (
    CONSTANTS,
    DELAY,
    FUNCTIONS,
    TIME,
    ExpressionError,
    Substitution,
    names_of,
    parse,
)
from firmware_runtime.models.qss.methods import METHODS, RESOLUTION, quantum_faults
from firmware_runtime.models.qss.segment import is_finite

_LEAST_QUANTUM: Final = 1e-100
"""Of a state that begins at 0."""
_TAKEN: Final = {*FUNCTIONS, *CONSTANTS, TIME, DELAY}
_NAME: Final = re.compile(r"[A-Za-z]\w*")
_NUMBERS: Final = ("states", "discrete", "parameters")
_TEXTS: Final = ("equations", "definitions")
_NAMED: Final = (*_NUMBERS, "definitions", "inputs")
_CROSSES: Final = re.compile(r"(.+?)\bcrosses\b(.+?)\b(rising|falling)?\s*$", re.DOTALL)


class When:
    """Event of a system when an expression crosses another: states and discrete values change.

    `event` is `"x crosses 0"`, with `rising` or `falling` behind it for one direction only, or a
    comparison such as `"x <= 0"`, for the instant at which it becomes true. The values are
    expressions, of what holds just before; with `only_if` nothing happens while that is false.
    """

    def __init__(self, event: str, *, only_if: str | None = None, **values: str | float) -> None:
        self.event = event
        self.only_if = only_if
        self.values = {name: str(value) for name, value in values.items()}

    def crossing(self) -> tuple[str, Direction, bool]:
        """The expression that crosses zero, in which direction, and whether zero is above it.

        Raises ExpressionError.
        """
        found = _CROSSES.fullmatch(self.event.strip())
        if found is not None:
            direction = cast("Direction", found[3] or "both")
            return f"({found[1].strip()}) - ({found[2].strip()})", direction, True
        larger, smaller, at_zero = self._comparison()
        return f"({ast.unparse(larger)}) - ({ast.unparse(smaller)})", "rising", at_zero

    def _comparison(self) -> tuple[ast.expr, ast.expr, bool]:
        """Return the larger side, the smaller one, and whether equal ones will do."""
        tree, is_denied = parse(self.event, {DELAY}), False
        while isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not):
            tree, is_denied = tree.operand, not is_denied
        match tree:
            case ast.Compare(left=larger, ops=[ast.Gt() | ast.GtE() as op], comparators=[smaller]):
                pass
            case ast.Compare(left=smaller, ops=[ast.Lt() | ast.LtE() as op], comparators=[larger]):
                pass
            case _:
                raise ExpressionError(
                    "no event",
                    where=f"{self.event!r}",
                    expected="such as 'x crosses 0 falling' or 'x > 1'",
                )
        at_zero = isinstance(op, ast.Gt | ast.Lt) is is_denied
        return (smaller, larger, at_zero) if is_denied else (larger, smaller, at_zero)


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
    `horizon_s` the errors of functions cut off, of time above all, add up to less than a quantum,
    however long one solves.
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
    horizon_s: float = 100.0

    def __post_init__(self) -> None:
        parts = (
            self._name_faults(),
            self._state_faults(),
            self._number_faults(),
            self._expression_faults(),
        )
        shape = list(self._shape_faults())
        faults = shape or list(dict.fromkeys(chain.from_iterable(parts)))
        if faults:
            raise ConfigError(self.name, faults)
        for name in (*_NUMBERS, "quantum", "relative_quantum"):
            object.__setattr__(self, name, _plain(getattr(self, name)))
        object.__setattr__(self, "horizon_s", float(self.horizon_s))

    def quantum_of(self, state: str) -> float:
        """The absolute quantum of a state."""
        return _of(self.quantum, state, 0.0)

    def relative_quantum_of(self, state: str) -> float:
        """The relative quantum of a state."""
        return _of(self.relative_quantum, state, 0.0)

    def tree_of(
        self, text: str, delay: Callable[[ast.Call], ast.expr] = lambda node: node
    ) -> ast.expr:
        """An expression with its definitions put in, and what `delay` makes of its delays.

        Raises ExpressionError.
        """
        return self._put_in(text, delay, ())

    def _put_in(
        self, text: str, delay: Callable[[ast.Call], ast.expr], above: tuple[str, ...]
    ) -> ast.expr:
        def put_in(name: str) -> ast.expr | None:
            sine = self.sine(name)
            text = self.definitions.get(name) if sine is None else sine.at(TIME)
            if name in above:
                raise ExpressionError(f"{name} is defined by itself")
            return None if text is None else self._put_in(text, delay, (*above, name))

        def put_in_delay(node: ast.Call) -> ast.expr:
            first = node.args[0] if node.args else None
            is_sine = isinstance(first, ast.Name) and self.sine(first.id) is not None
            node.args = [
                each if is_sine and each is first else substitution.visit(each)
                for each in node.args
            ]
            return delay(node)

        substitution = Substitution(put_in, put_in_delay)
        tree: ast.expr = substitution.visit(parse(text, {DELAY}))
        return tree

    def sine(self, name: str) -> Sine | None:
        """An input that is put into expressions as a function of time, as it is exact there."""
        source = self.inputs.get(name)
        return source if type(source) is Sine else None

    @property
    def shown(self) -> Sequence[str]:
        """The outputs; without any, the states."""
        return self.outputs or list(self.states)

    # Faults -------------------------------------------------------------------------------------

    def _shape_faults(self) -> Iterator[str]:
        """Return what is no mapping by name, no expression as text, no list of events."""
        for group in (*_NAMED, "equations"):
            given: object = getattr(self, group)
            if not isinstance(given, Mapping):
                yield f"{group} is {given!r}; expected a dictionary, by name"
                continue
            for name in given:
                if not isinstance(name, str):
                    yield f"{group}: {name!r} is no name; expected a text"
            if group in _TEXTS:
                yield from _no_texts(group, given)
        yield from _no_list("events", self.events, When, 'a list of When("x crosses 0", ...)')
        yield from _no_list("outputs", self.outputs, str, "a list of expressions as text")

    def _name_faults(self) -> Iterator[str]:
        known: dict[str, str] = {}
        for group in _NAMED:
            for name in getattr(self, group):
                if name in _TAKEN or iskeyword(name):
                    yield f"{group}: {name!r} has a meaning in expressions; expected another name"
                elif not _NAME.fullmatch(name):
                    yield f"{group}: {name!r} is no name; expected a letter, then letters or digits"
                if name in known:
                    yield f"{group}: {name!r} is one of {known[name]} too"
                known[name] = group
        for name, source in self.inputs.items():
            if "out" not in getattr(source, "out_ports", {}):
                yield f"inputs: {name} is {source!r}; expected an atomic model with a port out"

    def _state_faults(self) -> Iterator[str]:
        if not self.states:
            yield "states: none; expected one or more"
        for name in sorted(self.states.keys() - self.equations):
            yield f"equations: none for {name}"
        for group in ("equations", "quantum", "relative_quantum"):
            given = getattr(self, group)
            if isinstance(given, Mapping):
                for name in sorted(given.keys() - self.states):
                    yield f"{group}: {name} is no state"

    def _number_faults(self) -> Iterator[str]:
        if self.method not in tuple(METHODS):  # a comparison: it may be of any kind
            yield f"method is {self.method!r}; expected one of {', '.join(METHODS)}"
        if not (is_finite(self.horizon_s) and self.horizon_s > 0.0):
            yield f"horizon_s is {self.horizon_s!r}; expected more than 0"
        for group in _NUMBERS:
            for name, value in getattr(self, group).items():
                if not is_finite(value):
                    yield f"{group}: {name} is {value!r}; expected a finite number"
        for name, initial in self.states.items():
            quantum, relative = self.quantum_of(name), self.relative_quantum_of(name)
            faults = list(quantum_faults(quantum, relative))
            if not faults and is_finite(initial) and relative <= RESOLUTION:
                least = max(RESOLUTION * abs(initial), _LEAST_QUANTUM)
                if quantum < least:
                    faults = [f"quantum{{}} is {quantum!r}; expected {least:.1e} or more"]
            yield from (fault.format(f" of {name}") for fault in faults)

    def _expression_faults(self) -> Iterator[str]:
        for group in _TEXTS:
            for name, text in getattr(self, group).items():
                yield from self._text_faults(f"{group}: {name}", text)
        for number, event in enumerate(self.events, 1):
            yield from self._event_faults(f"events: {number}", event)
        for text in self.outputs:
            yield from self._text_faults("outputs", text)

    def _event_faults(self, where: str, event: When) -> Iterator[str]:
        try:
            texts = [event.crossing()[0]]
        except ExpressionError as error:
            yield f"{where}: {error}"
            texts = []
        for name in event.values:
            if name not in self.states and name not in self.discrete:
                yield f"{where}: {name} is neither a state nor discrete"
        texts += [*event.values.values(), *([] if event.only_if is None else [event.only_if])]
        for text in texts:
            yield from self._text_faults(where, text)

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


def _no_texts(where: str, given: Mapping[str, object]) -> Iterator[str]:
    for name, text in given.items():
        if not isinstance(text, str):
            yield f"{where}: {name} is {text!r}; expected an expression as text, such as '-x'"


def _no_list(group: str, given: object, kind: type, expected: str) -> Iterator[str]:
    if isinstance(given, str) or not isinstance(given, Sequence):
        yield f"{group} is {given!r}; expected {expected}"
        return
    for number, each in enumerate(given, 1):
        if not isinstance(each, kind):
            yield f"{group}: {each!r}; expected {expected}"
        elif isinstance(each, When):
            only_if = {} if each.only_if is None else {"only_if": each.only_if}
            yield from _no_texts(f"{group}: {number}", {"event": each.event, **only_if})


def _of(given: float | Mapping[str, float], name: str, otherwise: float) -> float:
    return given.get(name, otherwise) if isinstance(given, Mapping) else given


def _plain(given: float | Mapping[str, float]) -> float | dict[str, float]:
    """Floats in place of numbers of other kinds, such as numpy's."""
    if isinstance(given, Mapping):
        return {name: float(value) for name, value in given.items()}
    return float(given)
