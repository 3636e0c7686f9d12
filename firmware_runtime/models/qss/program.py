"""An expression compiled: its Taylor coefficients and its conditions.

The text becomes straight-line code once, before the run; an evaluation is then one call. Every
comparison of what changes between events is a condition: code of its own for the difference of its
sides, so that the instant at which it changes can be found, and a flag that the expression reads.
"""

import ast
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from firmware_runtime.models.qss.enclosure import RANGES, Enclosures
from firmware_runtime.models.qss.expression import (
    CONSTANTS,
    TIME,
    ExpressionError,
    Substitution,
    factors_of,
    names_of,
    parse,
)
from firmware_runtime.models.qss.series import Series, Writer

Code: TypeAlias = Callable[[float, Sequence[bool], Sequence[float]], tuple[float, ...]]
"""Called with time in s, the conditions' sides, and the inputs' coefficients one after another."""

Bound: TypeAlias = Callable[[float, Sequence[bool], Sequence[float], float], float]
"""Called with a duration in s too: the bound of a coefficient's magnitude from now to then."""

CONDITION: Final = 4
"""Conditions are bounded by their coefficient of this power of time."""
_BEYOND: Final = 2
"""So many coefficients more than are asked for say whether these are all."""
_USABLE: Final = {
    name: getattr(math, name)
    for name in (
        *("sin", "cos", "asin", "atan", "atan2", "sinh", "cosh", "tanh"),
        *("exp", "log", "pow", "inf", "nan"),
    )
} | {"abs": abs, "min": min, "max": max}


@dataclass(frozen=True, slots=True)
class Condition:
    """True while `code`'s value is above zero, or is zero without change and `at_zero` says so."""

    code: Code
    at_zero: bool
    bound: Bound | None
    """Of its coefficient of the fourth power; None if the coefficients are all there are."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of what an expression reads: variables, with the number of their coefficients."""

    variables: Mapping[str, int]
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Program:
    """`value` gives the coefficients, lowest first; `conditions` inner ones first."""

    value: Code
    conditions: tuple[Condition, ...]
    poles: Mapping[int, ast.expr]
    """What must not pass zero, such as a denominator, by the number of its condition."""
    degree: float
    """Of the polynomial in time that it is; infinite if it is none or of a higher one."""
    bound: Bound | None
    """Of the first coefficient left out, if that was asked for and more are."""


def compile_expression(
    tree: ast.expr, layout: Layout, length: int, *, is_bounded: bool = False
) -> Program:
    """Compile to so many coefficients, two more if these are all. Raises ExpressionError."""
    conditions = Conditions(layout)
    body = Body(layout, Writer(length + _BEYOND), conditions)
    result = body.series(tree)
    degree = _degree(result)
    count = length + _BEYOND if length <= degree < math.inf else length
    is_bounded = is_bounded and degree == math.inf
    bound = compile_bound(tree, layout, length, conditions) if is_bounded else None
    value = body.code(result[:count])
    return Program(value, tuple(conditions.found), body.poles, degree, bound)


def compile_condition(tree: ast.expr, layout: Layout, *, at_zero: bool) -> tuple[Condition, ...]:
    """The condition that an expression is above zero, last, and those that it reads before it."""
    conditions = Conditions(layout)
    conditions.number(tree, at_zero=at_zero)
    return tuple(conditions.found)


def compile_bound(
    tree: ast.expr, layout: Layout, power: int, conditions: "Conditions | None" = None
) -> Bound:
    """The bound of one coefficient over a stretch of time; its sides are those of the program."""
    body = _BoundBody(layout, Enclosures(power), conditions or Conditions(layout))
    return body.function("t, s, z, h", str(body.series(tree)[-1]))  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class Quanta:
    """Quanta of each input, absolute and relative, and the error that they allow."""

    of_inputs: Mapping[str, tuple[float, float]]
    least: float
    """An error of the result that is allowed anyway, in its unit."""
    relative: float = 0.0
    """The same as a share of the result."""


def compile_allowance(tree: ast.expr, layout: Layout, quanta: Quanta) -> Code:
    """The error that the result may have beside the one that the inputs' quanta cause anyway.

    A quarter of that, to first order: the sum of |partial derivative| times quantum.
    """
    body = Body(layout, Writer(1), Conditions(layout))
    total = "0.0"
    for name in names_of(tree):
        if name in quanta.of_inputs:
            absolute, relative = map(float, quanta.of_inputs[name])
            body.moving = name
            slope = body.series(tree)[1]
            width = f"max({absolute!r}, {relative!r} * abs({name}_0))"
            total = f"{total} + abs({slope}) * {width if relative else repr(absolute)}"
    allowances = [repr(float(quanta.least)), f"0.25 * ({total})"]
    if quanta.relative > 0.0:
        body.moving = ""
        allowances.append(f"{float(quanta.relative)!r} * abs({body.series(tree)[0]})")
    return body.code([f"max({', '.join(allowances)})"])


def _degree(result: Series) -> float:
    """The degree of a polynomial whose further coefficients are known to be zero.

    Infinity where the last one is not: of what is no polynomial all are unknown.
    """
    powers = [power for power, each in enumerate(result) if each != 0.0]
    degree = max(powers, default=0)
    return math.inf if degree == len(result) - 1 else degree


class Conditions:
    """The conditions that one expression reads, each once; those within others come first."""

    def __init__(self, layout: Layout) -> None:
        self.found: list[Condition] = []
        self._layout = layout
        self._numbers: dict[tuple[str, bool], int] = {}

    def number(self, difference: ast.expr, *, at_zero: bool) -> int:
        """The number of the flag that says whether something is above zero."""
        key = ast.unparse(difference), at_zero
        if key not in self._numbers:
            body = Body(self._layout, Writer(CONDITION + _BEYOND), self)
            result = body.series(difference)
            is_known = _degree(result) < math.inf
            bound = None if is_known else compile_bound(difference, self._layout, CONDITION, self)
            self._numbers[key] = len(self.found)
            self.found.append(Condition(body.code(result[:-1]), at_zero, bound))
        return self._numbers[key]


class Body:
    """The code of one function; conditions found on the way get functions of their own."""

    def __init__(self, layout: Layout, writer: Writer, conditions: Conditions) -> None:
        self.writer = writer
        self.moving: str | None = None
        """For a partial derivative: the one variable that changes, at rate 1."""
        self.poles: dict[int, ast.expr] = {}
        self._branches = 0
        self._layout = layout
        self._conditions = conditions

    def code(self, result: Series) -> Code:
        """The function of the lines that a result needs."""
        answer = ", ".join(str(each) for each in result)
        return self.function("t, s, z", f"({answer},)")  # type: ignore[no-any-return]

    def function(self, arguments: str, answer: str) -> Any:  # noqa: ANN401 -- as it is written
        """The compiled function; lines that nothing reads are left out."""
        variables = self._layout.variables
        unpacked = [f"{name}_{k}" for name, count in variables.items() for k in range(count)]
        lines = [f"def code({arguments}):"]
        if unpacked:
            lines.append(f"    {', '.join(unpacked)}, = z")
        lines += [*_needed(self.writer.lines, answer), f"    return {answer}"]
        space = {**_USABLE, **RANGES, "__builtins__": {}}
        exec("\n".join(lines), space)  # noqa: S102 -- written here, of names and numbers alone
        return space["code"]

    def series(self, node: ast.expr) -> Series:  # noqa: PLR0911 -- one for each kind of node
        """Write the lines for a tree; return where its coefficients are."""
        match node:
            case ast.Constant(value=value):
                return self.writer.constant(float(value))  # type: ignore[arg-type]  # parsed
            case ast.Name(id=name):
                return self._variable(name)
            case ast.UnaryOp(op=ast.Not()) | ast.BoolOp() | ast.Compare():
                return self._choice(self._test(node), _ONE, _NOUGHT)  # a truth is 1 or 0
            case ast.UnaryOp(op=op, operand=operand):
                inner = self.series(operand)
                return self.writer.negative(inner) if isinstance(op, ast.USub) else inner
            case ast.BinOp():
                return self._operation(node)
            case ast.IfExp(test=test, body=body, orelse=otherwise):
                return self._choice(self._test(test), body, otherwise)
            case ast.Call():
                return self._call(node)
        raise ExpressionError("not understood", where=ast.unparse(node))

    def _variable(self, name: str) -> Series:
        variables = self._layout.variables
        if name in variables or name == TIME:
            known: Series = [f"{name}_{k}" for k in range(variables.get(name, 0))] or [TIME, 1.0]
            if self.moving is not None:
                known = [known[0], 1.0 if name == self.moving else 0.0]
            return self.writer.polynomial(known)
        numbers = {**CONSTANTS, **self._layout.parameters}
        if name not in numbers:
            expected = ", ".join(sorted({*variables, *self._layout.parameters})) or "no name"
            raise ExpressionError(f"{name} is not known", expected=f"{expected}, or t")
        return self.writer.constant(float(numbers[name]))

    def _operation(self, node: ast.BinOp) -> Series:
        writer, left, right = self.writer, self.series(node.left), self.series(node.right)
        try:
            match node.op:
                case ast.Add():
                    return writer.add(left, right)
                case ast.Sub():
                    return writer.add(left, right, sign=-1.0)
                case ast.Mult():
                    return writer.multiply(left, right)
                case ast.Div():
                    self._note_poles(node.right)
                    return writer.divide(left, right)
            if writer.is_known(right) and float(right[0]) < 0.0:
                self._note_poles(node.left)
            return writer.power(left, right)
        except (ArithmeticError, ValueError) as error:
            raise ExpressionError(error, where=ast.unparse(node)) from error

    def _call(self, node: ast.Call) -> Series:
        name, arguments = node.func.id, node.args  # type: ignore[attr-defined]  # parsed
        if name in _MEANINGS:
            return self.series(_meant(name, arguments))
        if name == "atan2":
            above = self._compared(arguments[0], _NOUGHT, ast.GtE())
            y, x = (self.series(each) for each in arguments)
            return self.writer.atan2(y, x, above)
        try:
            return self.writer.function(name, self.series(arguments[0]))
        except (ArithmeticError, ValueError) as error:
            raise ExpressionError(error, where=ast.unparse(node)) from error

    # Conditions ---------------------------------------------------------------------------------

    def _choice(self, test: str, body: ast.expr, otherwise: ast.expr) -> Series:
        """Code that computes one of two, and leaves it in the same variables."""
        writer, results = self.writer, []
        names = writer.variables(writer.order + 1)
        self._branches += 1
        for opening, branch in ((f"if {test}:", body), ("else:", otherwise)):
            with writer.branch(opening):
                results.append(self.series(branch))
                for name, value in zip(names, results[-1], strict=True):
                    writer.let([name], str(value))
        self._branches -= 1
        pairs = zip(names, *results, strict=True)
        return [0.0 if one == other == 0.0 else name for name, one, other in pairs]

    def _test(self, node: ast.expr) -> str:
        match node:
            case ast.BoolOp(op=op, values=values):
                word = " and " if isinstance(op, ast.And) else " or "
                return f"({word.join(self._test(each) for each in values)})"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(not {self._test(operand)})"
            case ast.Compare(left=left, ops=ops, comparators=others):
                sides = [left, *others]
                pairs = zip(sides, others, ops, strict=False)
                return f"({' and '.join(self._compared(*pair) for pair in pairs)})"
        if not self._is_steady(node):
            raise ExpressionError("expected a comparison, such as x > 0", where=ast.unparse(node))
        return f"({self.series(node)[0]} != 0.0)"

    def _compared(self, left: ast.expr, right: ast.expr, op: ast.cmpop) -> str:
        sign = _COMPARISONS[type(op)]
        if self._is_steady(left) and self._is_steady(right):
            return f"({self.series(left)[0]} {sign} {self.series(right)[0]})"
        if sign in {"==", "!="}:
            shown = f"{ast.unparse(left)} {sign} {ast.unparse(right)}"
            raise ExpressionError(
                "compares what changes in between", where=shown, expected="< or >"
            )
        if sign in {"<", "<="}:
            left, right = right, left
        difference = ast.BinOp(left, ast.Sub(), right)
        if self.moving is not None:
            return f"({self.series(difference)[0]} > 0.0)"
        return f"s[{self._conditions.number(difference, at_zero=sign in {'<=', '>='})}]"

    def _note_poles(self, node: ast.expr) -> None:
        """Watch what is divided by, if it can change; not within a branch that may not be taken."""
        variables = self._layout.variables
        if self.moving is not None or self._branches > 0:
            return
        for factor in factors_of(node):
            if any(name == TIME or name in variables for name in names_of(factor)):
                self.poles[self._conditions.number(factor, at_zero=True)] = factor

    def _is_steady(self, node: ast.expr) -> bool:
        """Return whether it changes at events only."""
        counts = self._layout.variables
        return all(name != TIME and counts.get(name, 1) == 1 for name in names_of(node))


class _BoundBody(Body):
    """The code of a bound: both branches of a choice are computed, without a jump."""

    writer: Enclosures

    def _choice(self, test: str, body: ast.expr, otherwise: ast.expr) -> Series:
        return self.writer.choice(test, self.series(body), self.series(otherwise))

    def _note_poles(self, node: ast.expr) -> None:
        """None: the program has them."""


_NAMES: Final = re.compile(r"[A-Za-z_]\w*")


def _needed(lines: Sequence[str], answer: str) -> list[str]:
    """Those lines that an answer depends on."""
    read, kept = set(_NAMES.findall(answer)), []
    for line in reversed(lines):
        targets, is_assignment, value = line.partition(" = ")
        if not is_assignment or not read.isdisjoint(_NAMES.findall(targets)):
            read.update(_NAMES.findall(value or targets))
            kept.append(line)
    return kept[::-1]


_MEANINGS: Final = {
    "abs": "a if a >= 0 else -a",
    "sign": "1 if a > 0 else -1 if a < 0 else 0",
    "min": "a if a <= b else b",
    "max": "a if a >= b else b",
    "pow": "a ** b",
    "tan": "sin(a) / cos(a)",
    "acos": f"{0.5 * math.pi!r} - asin(a)",
}
"""Functions in terms of others, of a first argument and a second."""


def _meant(name: str, arguments: Sequence[ast.expr]) -> ast.expr:
    """Return what a function of some arguments means; of the third on as of a second one."""
    first, *others = arguments
    if len(others) > 1:
        others = [ast.Call(ast.Name(name), others, [])]
    given = dict(zip("ab", [first, *others], strict=False))
    meaning: ast.expr = Substitution(given.get, lambda node: node).visit(parse(_MEANINGS[name]))
    return meaning


_ONE: Final = ast.Constant(1.0)
_NOUGHT: Final = ast.Constant(0.0)
_COMPARISONS: Final[dict[type[ast.cmpop], str]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
