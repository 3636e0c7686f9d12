"""A chart in plain text: one series over time, as columns of eighth blocks."""

from collections.abc import Sequence

from firmware_runtime.devs.time import SECOND

_EIGHTHS = " ▁▂▃▄▅▆▇█"
_COLUMNS = 72
_ROWS = 8
_FINE = 0.01
"""Scales below it would read 0.000 at both ends."""


def chart(series: Sequence[tuple[int, float]], label: str, until: int) -> list[str]:
    """Lines of a chart of (instant in ns, value) from 0 to `until`; the mean of each column.

    The vertical scale goes from the least value to the greatest, and has zero on it.
    """
    columns = _means(series, until)
    known = [value for value in columns if value is not None]
    if not known:
        return [f"{label}: nothing to show"]
    low, high = min(0.0, *known), max(0.0, *known)
    span = high - low or 1.0
    eighths = [
        None if value is None else max(1, round((value - low) / span * 8 * _ROWS))
        for value in columns
    ]
    lines = [f"{label}"]
    for row in reversed(range(_ROWS)):
        mark = {_ROWS - 1: _mark(high, span), 0: _mark(low, span)}.get(row, "")
        lines.append(f"{mark:>7} ┤{''.join(_cell(height, row) for height in eighths).rstrip()}")
    lines.append(f"{'':7} └{'─' * _COLUMNS}")
    end = f"{round(until / SECOND, 2):g} s"
    lines.append(f"{'':9}0{end:>{_COLUMNS - 1}}")
    return lines


def _mark(value: float, span: float) -> str:
    """An end of the scale, seven characters wide however small the scale is."""
    return f"{value:7.0e}" if 0 < span < _FINE and value else f"{value:7.3f}"


def _means(series: Sequence[tuple[int, float]], until: int) -> list[float | None]:
    sums, counts = [0.0] * _COLUMNS, [0] * _COLUMNS
    for at, value in series:
        column = min(_COLUMNS - 1, at * _COLUMNS // max(until, 1))
        sums[column] += value
        counts[column] += 1
    return [total / count if count else None for total, count in zip(sums, counts, strict=True)]


def _cell(height: int | None, row: int) -> str:
    if height is None:
        return " "
    return _EIGHTHS[max(0, min(8, height - 8 * row))]
