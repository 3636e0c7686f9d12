"""Poles: what an expression divides by must not pass zero, or it has no value on the way."""

import ast
from collections.abc import Mapping, Sequence
from typing import ClassVar

from firmware_runtime.models.qss.program import Layout, Program, Quanta, compile_allowance

_NEAR = 8.0
"""In allowances, each a quarter of what quanta cause: a quantized input jumps by two at most."""


class Poles:
    """The denominators of one expression; each is a condition too, so that its root is found."""

    kept: ClassVar = ("above",)
    """The attributes that change."""

    def __init__(
        self, program: Program, layout: Layout, quanta: Mapping[str, tuple[float, float]]
    ) -> None:
        self._texts = {number: ast.unparse(tree) for number, tree in program.poles.items()}
        self._conditions = program.conditions
        self._near = {
            number: compile_allowance(tree, layout, Quanta(quanta, 0.0))
            for number, tree in program.poles.items()
        }
        self.above: dict[int, bool] = {}

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._texts)

    def check(
        self, t: float, sides: Sequence[bool], flat: Sequence[float], *, is_continuous: bool
    ) -> None:
        """Raise ZeroDivisionError if one has gone through zero since the last call.

        Where inputs have jumped since, one that is farther from zero than their quanta has been
        set to the other side, and has not gone through.
        """
        for number, text in self._texts.items():
            was, self.above[number] = self.above.get(number, sides[number]), sides[number]
            if was is sides[number]:
                continue
            (near,) = self._near[number](t, sides, flat)
            value = self._conditions[number].code(t, sides, flat)[0]
            if is_continuous or abs(value) <= _NEAR * near:
                raise ZeroDivisionError(f"{text} goes through 0")
