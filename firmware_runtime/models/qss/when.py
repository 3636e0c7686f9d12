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
        if _CROSSES.fullmatch(self.event.strip()) is not None:
            return False
        match parse(self.event, {DELAY}):
            case ast.Compare(ops=[ast.Gt() | ast.Lt()]):
                return True
        return False

    def crossing(self) -> tuple[str, Direction]:
        """The expression that crosses zero, and in which direction. Raises ExpressionError."""
        found = _CROSSES.fullmatch(self.event.strip())
        if found is not None:
            left, right, direction = found.groups()
            text = f"({left.strip()}) - ({right.strip()})"
            if direction == "rising":
                return text, "rising"
            return text, "falling" if direction == "falling" else "both"
        match parse(self.event, {DELAY}):
            case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
                return f"({ast.unparse(left)}) - ({ast.unparse(right)})", "rising"
            case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
                return f"({ast.unparse(right)}) - ({ast.unparse(left)})", "rising"
        raise ExpressionError(
            f"{self.event!r}: no event; expected such as 'x crosses 0 falling' or 'x > 1'"
        )
