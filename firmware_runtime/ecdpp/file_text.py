"""Text of E-CD++'s files: lines, comments, times, numbers, names without case."""

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import TypeVar

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import read_content

T = TypeVar("T")

_COMMENT = r"#|//|%"
_TIME = r"\d{1,6}(:\d{1,6}){2,4}"
_NUMBER = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?"
"""Compiled when first used: most runs read no such file."""


class Warnings:
    """Oddities of a file that is read all the same: of each kind its first line, and how many."""

    def __init__(self) -> None:
        self._kinds: dict[str, tuple[int, str, int]] = {}

    def note(self, line: int, what: str, kind: str) -> None:
        """Note `what` in a line, and why it is odd: the same for every line of its kind."""
        first, said, count = self._kinds.get(kind, (line, what, 0))
        self._kinds[kind] = first, said, count + 1

    def sentences(self) -> list[str]:
        """A sentence a kind, in the order in which they came."""
        return [
            f"line {line}: {what}: {kind}{f' (and {count - 1} more)' if count > 1 else ''}"
            for kind, (line, what, count) in self._kinds.items()
        ]


def read_text(path: Path, warnings: Warnings) -> str:
    """The text of a file, UTF-8 but for its comments. Raises ConfigError."""
    content = read_content(path)
    for number, line in enumerate(content.split(b"\n"), start=1):
        try:
            line.decode("utf-8-sig")
        except UnicodeDecodeError:
            said = re.split(_COMMENT.encode(), line, maxsplit=1)[0]
            if not said.isascii():
                fault = f"cannot be read: not UTF-8 in line {number}; expected text"
                raise ConfigError.of_one(str(path), fault) from None
            warnings.note(number, "a comment", "not UTF-8; it is passed over")
    return content.decode("utf-8-sig", "replace")


def lines_of(text: str) -> Iterator[tuple[int, str]]:
    """Numbered lines, from 1, that hold something besides a comment; without the comment."""
    for number, line in enumerate(text.split("\n"), start=1):
        content = re.split(_COMMENT, line, maxsplit=1)[0].strip()
        if content:
            yield number, content


def parse_time(text: str) -> int | None:
    """`HH:MM:SS:ms` in ns, or None; the last field is a number of ms, so `:50` is 0.050 s.

    Fields of one digit are taken, as in `0:0:10:0`, and what is above 59 is carried over, as in
    `00:00:75:00`: CD++ reads both. It also reads times without milliseconds, and writes some with
    microseconds behind them.
    """
    if re.fullmatch(_TIME, text, re.ASCII) is None:
        return None
    hours, minutes, seconds, milliseconds, microseconds = _fields(text)
    whole = (hours * 60 + minutes) * 60 + seconds
    return (whole * 1000 + milliseconds) * MILLISECOND + microseconds * MICROSECOND


def is_carried(text: str) -> bool:
    """Return whether a time has more minutes or seconds than 59, or finer parts above 999."""
    _, minutes, seconds, *finer = _fields(text)
    return minutes > 59 or seconds > 59 or max(finer) > 999


def _fields(time: str) -> list[int]:
    """Hours, minutes, seconds, milliseconds and microseconds; what is not stated is 0."""
    stated = [int(field) for field in time.split(":")]
    return stated + [0] * (5 - len(stated))


def format_time(at: int) -> str:
    """An instant as `HH:MM:SS:mmm`; what is finer than a millisecond is cut off."""
    rest, milliseconds = divmod(at // MILLISECOND, 1000)
    rest, seconds = divmod(rest, 60)
    hours, minutes = divmod(rest, 60)
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}:{milliseconds:03d}"


def parse_number(text: str) -> float | None:
    """A whole number or a decimal, with an exponent or without; or None."""
    number = float(text) if re.fullmatch(_NUMBER, text, re.ASCII) else math.nan
    return number if math.isfinite(number) else None


def format_number(value: float) -> str:
    """A finite number without exponent, a whole one without decimals; raises ValueError."""
    if not math.isfinite(value):
        raise ValueError(f"{value}: expected a finite number")
    return str(int(value)) if float(value).is_integer() else format(Decimal(repr(value)), "f")


def look_up(names: Mapping[str, T], name: str) -> T | None:
    """Return what stands under a name, written exactly so or else with other case."""
    if name in names:
        return names[name]
    folded = name.casefold()
    return next((each for key, each in names.items() if key.casefold() == folded), None)
