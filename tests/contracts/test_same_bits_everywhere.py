"""Between an edge and an output nothing is computed that another machine computes to other bits."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

PROJECT: Final = Path(__file__).parents[2]
LIBRARY: Final = frozenset(
    {
        *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
        *("asinh", "acosh", "atanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p"),
        *("pow", "cbrt", "hypot", "dist", "erf", "erfc", "gamma", "lgamma", "rect", "phase"),
        *("polar", "sumprod"),
    }
)
"""Names of `math` and `cmath` whose last bit is the C library's, or the interpreter's."""
ELSEWHERE: Final = {
    "drivers/firmware_drivers/ros_messages.py": "in the bridge's process, for ROS",
    "boards/firmware_boards/tachobot/track_result.py": "of a run that has ended",
}
EXACT_SUMS: Final = {
    "drivers/firmware_drivers/chips/step.py": "of whole nanoseconds",
    "drivers/firmware_drivers/commands/probing.py": "of truth values",
    "boards/firmware_boards/tachobot/allocation.py": "of 0, 1 and 0.25, which is exact",
}


def modules() -> Iterator[Path]:
    """What a replay runs: drivers, boards but for their experiments, and the runtime's models."""
    yield from (PROJECT / "drivers").rglob("*.py")
    yield from (PROJECT / "boards/firmware_boards").glob("*/*.py")
    yield from (PROJECT / "firmware_runtime/models").glob("*.py")


def test_nothing_in_a_replay_takes_the_library_s_functions() -> None:
    found = [
        f"{path}:{node.lineno}: {name}; expected firmware_runtime.system.elementary, or a product"
        for path, tree in _trees()
        if path not in ELSEWHERE
        for node, name in _of_the_library(tree)
    ]
    assert found == []


def test_nothing_in_a_replay_sums_floats_by_the_interpreter() -> None:
    found = [
        f"{path}:{node.lineno}: sum(), which compensates since 3.12; expected a loop"
        for path, tree in _trees()
        if path not in EXACT_SUMS and path not in ELSEWHERE
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and _name(node.func) == "sum"
    ]
    assert found == []


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("import math\nmath.sin(x)", "math.sin"),
        ("from math import atan2, inf\n", "math.atan2"),
        ("y = x**2", "**"),
        ("y = 2.0**-46", None),
        ("import math\nmath.sqrt(math.remainder(x, math.tau))", None),
    ],
)
def test_the_rule_finds_what_it_is_for(source: str, name: str | None) -> None:
    found = [name for _, name in _of_the_library(ast.parse(source))]
    assert found == ([] if name is None else [name])


@pytest.mark.slow
def test_every_exception_is_still_one() -> None:
    trees = dict(_trees())
    assert all(any(_of_the_library(trees[path])) for path in ELSEWHERE)
    assert all("sum(" in ast.unparse(trees[path]) for path in EXACT_SUMS)


def _trees() -> Iterator[tuple[str, ast.Module]]:
    for path in modules():
        yield str(path.relative_to(PROJECT)), ast.parse(path.read_text(encoding="utf-8"))


def _of_the_library(tree: ast.AST) -> Iterator[tuple[ast.stmt | ast.expr, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module in {"math", "cmath"}:
            names = [each.name for each in node.names if each.name in LIBRARY]
            yield from ((node, f"{node.module}.{name}") for name in names)
        elif isinstance(node, ast.Attribute) and _name(node.value) in {"math", "cmath"}:
            if node.attr in LIBRARY:
                yield node, f"{_name(node.value)}.{node.attr}"
        elif isinstance(node, ast.BinOp) and _is_power(node):
            yield node, "**"


def _is_power(node: ast.BinOp) -> bool:
    """Whether it is a power that is not known when the module is compiled."""
    is_known = _is_constant(node.left) and _is_constant(node.right)
    return isinstance(node.op, ast.Pow) and not is_known


def _is_constant(node: ast.expr) -> bool:
    return isinstance(node.operand if isinstance(node, ast.UnaryOp) else node, ast.Constant)


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else ""
