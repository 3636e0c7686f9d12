"""The assertion that no device was asked for what a real one would not take as meant."""

from collections.abc import Iterable
from typing import Protocol

import pytest


class Warned(Protocol):
    """Doubles of a test, with what they warned of."""

    def warnings(self) -> list[str]:
        """One sentence each."""


def check(sources: Iterable[Warned]) -> None:
    """Fail the test where a double warned, with every warning."""
    __tracebackhide__ = True
    if warnings := [warning for each in sources for warning in each.warnings()]:
        listing = "\n".join(f"  {each}" for each in warnings)
        pytest.fail(f"protocol warnings, expected none:\n{listing}", pytrace=False)
