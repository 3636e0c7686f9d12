"""How far off the result of an expression may be, as its inputs are only known to a quantum."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass

from firmware_runtime.models.qss.expression import names_of
from firmware_runtime.models.qss.program import Body, Code, Conditions, Layout
from firmware_runtime.models.qss.series import Writer


@dataclass(frozen=True, slots=True)
class Quanta:
    """How far off each input may be, as absolute and relative quantum, and what that allows."""

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
    least, share = float(quanta.least), float(quanta.relative)
    total = "0.0"
    for name, width_of in quanta.of_inputs.items():
        absolute, relative = map(float, width_of)
        if name not in names_of(tree):
            continue
        body.moving = name
        slope = body.series(tree)[1]
        width = f"max({absolute!r}, {relative!r} * abs({name}_0))" if relative else repr(absolute)
        total = body.writer.assign(f"{total} + abs({slope}) * {width}")
    allowances = [repr(least), f"0.25 * {total}"]
    if share > 0.0:
        body.moving = ""
        allowances.append(f"{share!r} * abs({body.series(tree)[0]})")
    return body.code([f"max({', '.join(allowances)})"])
