"""Expectations of the contract: what does not hold is an AssertionError with a sentence."""

import re
from collections.abc import Callable
from typing import TypeVar

from sim_doubles.contract.row import Row

E = TypeVar("E", bound=Exception)


def expect(condition: bool, sentence: str) -> None:  # noqa: FBT001 -- as assert takes it
    """Raise AssertionError with the sentence unless the condition holds."""
    if not condition:
        raise AssertionError(sentence)


def expect_equal(what: str, found: object, expected: object) -> None:
    """Raise AssertionError unless the two are equal."""
    expect(found == expected, f"{what}: {found!r}, expected {expected!r}")


def expect_raised(kind: type[E], matching: str, action: Callable[[], object]) -> None:
    """Raise AssertionError unless the action raises this kind, with a text that matches."""
    try:
        action()
    except kind as error:
        expect(
            re.search(matching, str(error)) is not None,
            f"{kind.__name__} says {str(error)!r}, expected a text like {matching!r}",
        )
        return
    raise AssertionError(f"nothing was raised, expected {kind.__name__}")


def expect_sound(row: Row) -> None:
    """Raise AssertionError if the double noted a warning or the bus an error."""
    expect_equal("protocol warnings", list(row.warnings()), [])
    expect_equal("errors on the bus", row.bus.errors, 0)


def expect_swept(row: Row) -> None:
    """Raise AssertionError unless every value came through within its epsilon."""
    for true, found, epsilon in row.sweep():
        expect(
            abs(found - true) <= epsilon,
            f"{true!r} came through as {found!r}, expected within {epsilon!r}",
        )
