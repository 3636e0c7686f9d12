"""What E-CD++'s text files have in common: lines, comments, times, numbers, names without case."""

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import TypeVar

from firmware_runtime.devs.time import MILLISECOND

T = TypeVar("T")

_COMMENT = r"#|//|%"
_TIME = r"(\d{1,6}):([0-5]?\d):([0-5]?\d):(\d{1,3})"
_NUMBER = r"[+-]?(\d+(\.\d*)?|\.\d+)"
"""Compiled when first used: most runs read no such file."""


def lines_of(text: str) -> Iterator[tuple[int, str]]:
    """Numbered lines, from 1, that hold something besides a comment; without the comment."""
    for number, line in enumerate(text.split("\n"), start=1):
        content = re.split(_COMMENT, line, maxsplit=1)[0].strip()
        if content:
            yield number, content


def parse_time(text: str) -> int | None:
    """`HH:MM:SS:ms` in ns, or None; the last field is a number of ms, so `:50` is 0.050 s.

    Fields of one digit are taken, as in `0:0:10:0`, which many a file of CD++ has.
    """
    match = re.fullmatch(_TIME, text, re.ASCII)
    if match is None:
        return None
    hours, minutes, seconds, milliseconds = map(int, match.groups())
    return (((hours * 60 + minutes) * 60 + seconds) * 1000 + milliseconds) * MILLISECOND


def format_time(at: int) -> str:
    """An instant as `HH:MM:SS:mmm`; what is finer than a millisecond is cut off."""
    rest, milliseconds = divmod(at // MILLISECOND, 1000)
    rest, seconds = divmod(rest, 60)
    hours, minutes = divmod(rest, 60)
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}:{milliseconds:03d}"


def parse_number(text: str) -> float | None:
    """A whole number or a decimal, or None."""
    number = float(text) if re.fullmatch(_NUMBER, text, re.ASCII) else math.nan
    return number if math.isfinite(number) else None


def format_number(value: float) -> str:
    """A finite number without exponent, a whole one without decimals; raises ValueError."""
    if not math.isfinite(value):
        raise ValueError(f"{value}: expected a finite number")
    return str(int(value)) if float(value).is_integer() else format(Decimal(repr(value)), "f")


def look_up(names: Mapping[str, T], name: str) -> T | None:
    """What stands under a name, written exactly so or else with other case."""
    if name in names:
        return names[name]
    folded = name.casefold()
    return next((each for key, each in names.items() if key.casefold() == folded), None)
