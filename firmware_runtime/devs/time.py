"""Time is an integer number of nanoseconds since the start of the run.

Sums are exact, so two events are simultaneous when their instants are equal and a period never
drifts. "Never" is one named constant, an integer too, later than any instant.
"""

from math import isfinite
from numbers import Real
from operator import index
from typing import Final

from firmware_runtime.errors import SettingError

NEVER: Final = (1 << 63) - 1
"""The instant that does not come, and the duration of a passive state."""

ZERO: Final = 0
"""The duration of a state that is left at the instant it is entered."""

NANOSECOND: Final = 1
MICROSECOND: Final = 1_000
MILLISECOND: Final = 1_000_000
SECOND: Final = 1_000_000_000

LONGEST_S: Final = 1e9
"""Seconds that a person may state at most, 31 years: a longer span is a slip of a key."""


def whole(number: object) -> int | None:
    """A whole number of any type, such as numpy's, as an `int`; None for anything else."""
    if isinstance(number, bool):
        return None
    try:
        return index(number)  # type: ignore[arg-type]  # that is the question
    except TypeError:
        return None


def kept(number: object) -> int:
    """A count or an instant of a state that was kept; there is room for more beyond it.

    Raises ValueError for anything else, as may stand in a file.
    """
    if isinstance(number, int) and (-_MOST <= number <= _MOST or number == NEVER):
        return number
    raise ValueError(f"{number!r:.40}; expected a whole number of less than 63 bits")


_MOST: Final = 1 << 62


def seconds(value: float) -> int:
    """Seconds as the nearest whole number of nanoseconds. Raises SettingError for no number."""
    if not (isinstance(value, Real) and isfinite(value)):
        raise SettingError(f"{value!r} seconds", expected="a finite number")
    return round(value * SECOND)


def format_time(at: int) -> str:
    """An instant as people read it: seconds with nine decimals, or `never`."""
    if at == NEVER:
        return "never"
    whole, rest = divmod(at, SECOND)
    return f"{whole}.{rest:09d} s"
