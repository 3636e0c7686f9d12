"""Readings of a chip as a person or a program wants them: one live line, lines, or JSON lines."""

import json
from contextlib import suppress
from select import select
from typing import Any, TextIO

from drivers.catalogue.trial import Quantity, Reading
from firmware_runtime.devs.time import SECOND

_CLEAR_REST = "\x1b[K"


class Readings:
    """Shows readings on a stream; at a terminal each takes the place of the one before.

    While something moves (`never_waits`), output that would have to wait, for a full pipe or a
    terminal that was halted, is dropped, and so is a reading that says nothing new.
    """

    def __init__(self, stream: TextIO, *, as_json: bool, never_waits: bool) -> None:
        self._stream = stream
        self._as_json = as_json
        self._never_waits = never_waits
        self._is_live = stream.isatty() and not as_json
        self._last: Reading | None = None

    def show(self, at: int, reading: Reading) -> None:
        """Show what was read so many ns after the start."""
        if self._as_json:
            self._print(json.dumps(_document(at, reading)) + "\n", reading)
        elif self._is_live:
            self._print(f"\r{at / SECOND:8.2f} s  {line(reading)}{_CLEAR_REST}", reading)
        else:
            self._print(f"{at / SECOND:.2f} s  {line(reading)}\n", reading)

    def end(self) -> None:
        """Let what is printed next begin a line of its own."""
        if self._is_live and self._last is not None:
            self._print("\n", None)

    def _print(self, text: str, reading: Reading | None) -> None:
        if not self._never_waits:
            self._write(text)
        elif self._is_live or reading != self._last:
            with suppress(OSError, ValueError):
                if select((), [self._stream], (), 0)[1]:
                    self._write(text)
        self._last = reading

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


def line(reading: Reading) -> str:
    """All quantities in one line, for people."""
    return "  ".join(map(_spelled, reading))


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
