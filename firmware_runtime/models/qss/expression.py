"""An expression of a system, as text: parsed, never evaluated as Python, checked by a short list.

Numbers, names, `+ - * / **`, comparisons, `and or not`, `a if condition else b`, and calls of the
functions of `FUNCTIONS`. Anything else is refused with a sentence.
"""

import ast
import math
from collections.abc import Callable, Collection, Iterator
from typing import Final

from firmware_runtime.devs.model_errors import ModelError

CONSTANTS: Final = {"pi": math.pi, "tau": math.tau, "e": math.e}
TIME: Final = "t"
DELAY: Final = "delay"
"""What only a system understands, and takes out of its expressions before they are compiled."""

FUNCTIONS: Final[dict[str, tuple[int, int]]] = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan"), (1, 1)),
    **dict.fromkeys(("sinh", "cosh", "tanh", "exp", "log", "sqrt"), (1, 1)),
    **dict.fromkeys(("abs", "sign"), (1, 1)),
    "atan2": (2, 2),
    "pow": (2, 2),
    "min": (2, 16),
    "max": (2, 16),
}
"""How many arguments each takes, at least and at most."""

_LONGEST: Final = 10_000
_ARITHMETIC: Final = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow)
_COMPARISONS: Final = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)


class ExpressionError(ModelError, ValueError):
    """A text that is no expression, or one with something that is not understood."""


def parse(text: str, extra: Collection[str] = ()) -> ast.expr:
    """The expression's tree. Raises ExpressionError; `extra` names are functions too."""
    if len(text) > _LONGEST:
        raise ExpressionError(f"an expression of {len(text)} characters", expected=_LONGEST)
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        fault = next(_faults(tree, extra), None)
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        detail = error.msg if isinstance(error, SyntaxError) else "nested too deeply"
        raise ExpressionError(detail, where=f"{text!r}", expected="an expression") from error
    if fault is not None:
        raise ExpressionError(fault, where=f"{text!r}")
    return tree


def names_of(tree: ast.expr) -> list[str]:
    """The variables it reads, in order of appearance; constants and functions are none."""
    functions = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    found = (
        node.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and id(node) not in functions
    )
    return list(dict.fromkeys(name for name in found if name not in CONSTANTS))


class Substitution(ast.NodeTransformer):
    """Puts other expressions in the place of names and of delays."""

    def __init__(
        self, of_name: Callable[[str], ast.expr | None], of_delay: Callable[[ast.Call], ast.expr]
    ) -> None:
        self._of_name, self._of_delay = of_name, of_delay

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """A delay is the other's matter, of other functions their arguments."""
        if isinstance(node.func, ast.Name) and node.func.id == DELAY:
            return self._of_delay(node)
        node.args = [self.visit(each) for each in node.args]
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Return what stands for a name, or the name."""
        return self._of_name(node.id) or node


def factors_of(node: ast.expr) -> Iterator[ast.expr]:
    """Return what something is zero with: the factors of a product, the base of a power."""
    match node:
        case (
            ast.UnaryOp(operand=base)
            | ast.BinOp(left=base, op=ast.Pow() | ast.Div())
            | ast.Call(func=ast.Name(id="abs" | "sqrt"), args=[base])
        ):
            yield from factors_of(base)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            yield from factors_of(left)
            yield from factors_of(right)
        case _:
            yield node


def _faults(node: ast.expr, extra: Collection[str]) -> Iterator[str]:
    yield from _fault_of(node, extra)
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr) and not (isinstance(node, ast.Call) and child is node.func):
            yield from _faults(child, extra)


def _fault_of(node: ast.expr, extra: Collection[str]) -> Iterator[str]:
    match node:
        case ast.Constant(value=value):
            if not isinstance(value, int | float) or not math.isfinite(value):
                yield f"{value!r} is no number"
        case ast.BinOp(op=op) if not isinstance(op, _ARITHMETIC):
            yield f"{type(op).__name__} is not known; expected + - * / **"
        case ast.UnaryOp(op=op) if not isinstance(op, ast.USub | ast.UAdd | ast.Not):
            yield f"{type(op).__name__} is not known; expected - or not"
        case ast.Compare(ops=ops) if not all(isinstance(op, _COMPARISONS) for op in ops):
            yield "expected comparisons by < <= > >= == !="
        case ast.Call():
            yield from _call_faults(node, extra)
        case ast.Name() | ast.BinOp() | ast.UnaryOp() | ast.Compare() | ast.BoolOp() | ast.IfExp():
            pass
        case _:
            yield f"{type(node).__name__} is not understood; expected arithmetic and functions"


def _call_faults(node: ast.Call, extra: Collection[str]) -> Iterator[str]:
    if not isinstance(node.func, ast.Name) or node.keywords:
        yield "expected calls such as sin(x)"
        return
    name = node.func.id
    if name in extra:
        return
    if name not in FUNCTIONS:
        yield f"function {name!r} is not known; expected one of {', '.join(sorted(FUNCTIONS))}"
        return
    least, most = FUNCTIONS[name]
    if not least <= len(node.args) <= most:
        yield f"{name} takes {least} argument{'s' * (least > 1)}, not {len(node.args)}"
