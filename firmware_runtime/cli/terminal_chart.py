"""A small chart in plain text: one series over time, as columns of eighth blocks."""

from collections.abc import Sequence

from firmware_runtime.devs.time import SECOND

_EIGHTHS = " ▁▂▃▄▅▆▇█"
_COLUMNS = 60
_ROWS = 3
_FINE = 0.01
"""Scales below it would read 0.000 at both ends."""


def chart(series: Sequence[tuple[int, float]], label: str, until: int) -> list[str]:
    """Lines of a chart of (instant in ns, value) from 0 to `until`; none without a value.

    A column is the mean of what came in its time; one in which nothing came holds the last value.
    The vertical scale goes from the least value to the greatest, and has zero on it.
    """
    columns = _columns(series, until)
    known = [value for value in columns if value is not None]
    if not known:
        return []
    low, high = min(0.0, *known), max(0.0, *known)
    span = high - low or 1.0
    eighths = [
        None if value is None else max(1, round((value - low) / span * 8 * _ROWS))
        for value in columns
    ]
    marks = {_ROWS - 1: _mark(high, span) if high > low else "", 0: _mark(low, span)}
    lines = []
    for row in reversed(range(_ROWS)):
        mark = marks.get(row, "")
        lines.append(f"{mark:>7} ┤{''.join(_cell(height, row) for height in eighths).rstrip()}")
    return [*lines, f"{'':7} └ {label}, 0 to {round(until / SECOND, 2):g} s"]


def _mark(value: float, span: float) -> str:
    """An end of the scale, seven characters wide however small the scale is."""
    return f"{value:7.0e}" if 0 < span < _FINE and value else f"{value:7.3f}"


def _columns(series: Sequence[tuple[int, float]], until: int) -> list[float | None]:
    """The mean of each column, or the last value before it; None before the first."""
    values: list[list[float]] = [[] for _ in range(_COLUMNS)]
    for at, value in series:
        values[min(_COLUMNS - 1, at * _COLUMNS // max(until, 1))].append(value)
    columns: list[float | None] = []
    held: float | None = None
    for own in values:
        columns.append(sum(own) / len(own) if own else held)
        held = own[-1] if own else held
    return columns


def _cell(height: int | None, row: int) -> str:
    if height is None:
        return " "
    return _EIGHTHS[max(0, min(8, height - 8 * row))]
