"""An event of a system: what changes, and when."""

import ast
import re
from typing import Final

from firmware_runtime.models.qss.crossing import Direction
from firmware_runtime.models.qss.expression import DELAY, ExpressionError, parse

_CROSSES: Final = re.compile(r"(.+?)\bcrosses\b(.+?)\b(rising|falling)?\s*$", re.DOTALL)


class When:
    """What happens when an expression crosses another: states and discrete variables change.

    `event` is `"x crosses 0"`, with `rising` or `falling` behind it for one direction only, or a
    comparison such as `"x <= 0"`, for the instant at which it becomes true. The values are
    expressions, of what holds just before; with `only_if` nothing happens while that is false.
    """

    def __init__(self, event: str, *, only_if: str | None = None, **values: str | float) -> None:
        self.event = event
        self.only_if = only_if
        self.values = {name: str(value) for name, value in values.items()}

    def is_strict(self) -> bool:
        """Whether it is a comparison that equal sides do not meet. Raises ExpressionError."""
        return _CROSSES.fullmatch(self.event.strip()) is None and self._comparison()[2]

    def crossing(self) -> tuple[str, Direction]:
        """The expression that crosses zero, and in which direction. Raises ExpressionError."""
        found = _CROSSES.fullmatch(self.event.strip())
        if found is None:
            larger, smaller, _ = self._comparison()
            return f"({ast.unparse(larger)}) - ({ast.unparse(smaller)})", "rising"
        left, right, direction = found.groups()
        text = f"({left.strip()}) - ({right.strip()})"
        if direction == "rising":
            return text, "rising"
        return text, "falling" if direction == "falling" else "both"

    def _comparison(self) -> tuple[ast.expr, ast.expr, bool]:
        """What becomes the larger side, what the smaller one, and whether equal ones do not do."""
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
                    f"{self.event!r}: no event; expected such as 'x crosses 0 falling' or 'x > 1'"
                )
        is_strict = isinstance(op, ast.Gt | ast.Lt) is not is_denied
        return (smaller, larger, is_strict) if is_denied else (larger, smaller, is_strict)
