"""Readings of a chip as a person or a program wants them: a live block, lines, or JSON lines."""

import json
from contextlib import suppress
from select import select
from typing import Any, TextIO

from firmware_drivers.catalogue.trial import Quantity, Reading
from firmware_runtime.devs.time import SECOND

_CLEAR_REST = "\x1b[K"
_UP = "\x1b[{}A"


class Readings:
    """Shows readings on a stream; at a terminal each takes the place of the one before.

    While something moves (`never_waits`), output that would have to wait, for a full pipe or a
    terminal that was halted, is dropped, and so is a line that says nothing new. Where there is no
    stream nothing is shown.
    """

    def __init__(self, stream: TextIO | None, *, as_json: bool, never_waits: bool) -> None:
        self._stream = stream
        self._as_json = as_json
        self._never_waits = never_waits
        self._is_live = stream is not None and stream.isatty() and not as_json
        self._block = 0  # lines of the reading that stands there
        self._last: Reading | None = None

    def show(self, at: int, reading: Reading) -> None:
        """Show what was read so many ns after the start."""
        if self._as_json:
            text = json.dumps(_document(at, reading)) + "\n"
        elif self._is_live:
            text = self._in_place(at, reading)
        else:
            text = f"{at / SECOND:.2f} s  {'  '.join(map(_spelled, reading))}\n"
        if not self._never_waits:
            self._write(text)
        elif self._is_live or reading != self._last:
            with suppress(OSError, ValueError):
                if self._stream is not None and select((), [self._stream], (), 0)[1]:
                    self._write(text)
        self._last = reading

    def end(self) -> None:
        """Let what is printed next stand below."""
        self._block = 0

    def _in_place(self, at: int, reading: Reading) -> str:
        """A line for each quantity, over those of the reading before: no terminal is too narrow."""
        lines = [f"{at / SECOND:.1f} s", *(f"  {_spelled(each)}" for each in reading)]
        up = _UP.format(self._block) if self._block else ""
        self._block = len(lines)
        return up + "".join(f"\r{line}{_CLEAR_REST}\n" for line in lines)

    def _write(self, text: str) -> None:
        if self._stream is not None:
            self._stream.write(text)
            self._stream.flush()


def _spelled(quantity: Quantity) -> str:
    value = quantity.value
    if value is None:
        return f"{quantity.label} none"
    values = value if isinstance(value, tuple) else (value,)
    numbers = " ".join(f"{each * quantity.scale:.{quantity.decimals}f}" for each in values)
    return f"{quantity.label} {numbers} {quantity.unit}".rstrip()


def _document(at: int, reading: Reading) -> dict[str, Any]:
    """JSON has no infinity: a sonar without echo is null."""
    return {"t_s": round(at / SECOND, 6), **{each.key: _finite(each.value) for each in reading}}


def _finite(value: float | tuple[float, ...] | None) -> float | tuple[float, ...] | None:
    return None if value in (float("inf"), None) else value
