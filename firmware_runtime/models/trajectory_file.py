"""A path from a file of poses: clamped cubic splines through them, at rest at both ends.

The file is CSV: a line `t_s,x_m,y_m,yaw_rad`, then one pose a line; times begin at 0 and rise. Yaw
is taken as it stands: from 3 to -3 it turns back by 6 rad, from 3 to 3.28 on by 0.28.
"""

import csv
import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Final

from firmware_runtime.models.motion import PoseSetpoint, Setpoint, at_rest

COLUMNS: Final = ("t_s", "x_m", "y_m", "yaw_rad")
LONGEST: Final = 100_000
"""Poses that a file may have."""
_SHOWN = 10
"""Faults of a file that are listed."""

_Row = tuple[float, float, float, float]


class Spline:
    """Twice continuously differentiable through all poses of a table.

    `rows` are (t_s, x_m, y_m, yaw_rad), at least two, times rising from 0.
    """

    def __init__(self, rows: Sequence[_Row]) -> None:
        self._times, *coordinates = ([row[column] for row in rows] for column in range(4))
        self._coordinates = [(values, _slopes(self._times, values)) for values in coordinates]

    @property
    def duration_s(self) -> float:
        """The last row's time."""
        return self._times[-1]

    def at(self, t_s: float) -> PoseSetpoint:
        """The setpoint, on the cubic between the two rows around that time."""
        if t_s >= self._times[-1]:
            return PoseSetpoint(*(at_rest(values[-1]) for values, _ in self._coordinates))
        n = bisect_right(self._times, t_s) - 1
        begin, end = self._times[n : n + 2]
        return PoseSetpoint(
            *(
                _cubic(values[n : n + 2], slopes[n : n + 2], t_s - begin, end - begin)
                for values, slopes in self._coordinates
            )
        )


def path_of_file(file: FilePath) -> Spline:
    """The path of a file. Raises ValueError with all of its faults, each with its line."""
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        fault = "cannot be read: not UTF-8; expected a CSV file of poses"
        raise ValueError(f"{file}: {fault}") from error
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror}; expected a CSV file of poses") from error
    try:
        lines = [*csv.reader(text.splitlines())]
    except csv.Error as error:
        raise ValueError(f"{file}: {error}; expected a CSV file of poses") from error
    faults, rows = [f"{file}: {fault}" for fault in _header_faults(lines)], list[_Row]()
    if not faults:
        faults = [f"{file}: {fault}" for fault in _row_faults(lines[1:], rows)]
    if faults:
        left = [f"{len(faults) - _SHOWN} more"] if len(faults) > _SHOWN else []
        raise ValueError("; ".join(faults[:_SHOWN] + left))
    return Spline(rows)


def _header_faults(lines: Sequence[Sequence[str]]) -> Iterator[str]:
    if not lines or tuple(lines[0]) != COLUMNS:
        found = ",".join(lines[0]) if lines else "nothing"
        yield f"line 1: {found[:80]!r}, expected {','.join(COLUMNS)}"
    if not 3 <= len(lines) <= LONGEST + 1:
        yield f"{max(len(lines) - 1, 0)} poses, expected 2 to {LONGEST}"


def _row_faults(lines: Sequence[Sequence[str]], rows: list[_Row]) -> Iterator[str]:
    """Return what is wrong with the poses; the sound ones go into `rows`."""
    before = -math.inf
    for number, line in enumerate(lines, 2):
        row = _numbers(line)
        if row is None:
            yield f"line {number}: {','.join(line)[:80]!r}, expected four finite numbers"
            continue
        if number == 2 and row[0] != 0.0:
            yield f"line 2: t_s {row[0]:g}, expected 0"
        elif row[0] <= before:
            yield f"line {number}: t_s {row[0]:g}, expected more than {before:g}"
        before = row[0]
        rows.append(row)


def _numbers(line: Sequence[str]) -> _Row | None:
    try:
        t, x, y, yaw = map(float, line)
    except ValueError:
        return None
    return (t, x, y, yaw) if all(map(math.isfinite, (t, x, y, yaw))) else None


def _slopes(times: Sequence[float], values: Sequence[float]) -> list[float]:
    """The spline's rate at each row, zero at both ends: a tridiagonal system, solved in order."""
    spans = [b - a for a, b in pairwise(times)]
    steps = [b - a for a, b in pairwise(values)]
    chords = [step / span for step, span in zip(steps, spans, strict=True)]
    factors, rights = [0.0], [0.0]
    for n in range(1, len(values) - 1):
        before, after = spans[n - 1], spans[n]
        pivot = 2.0 * (before + after) - after * factors[-1]
        right = 3.0 * (after * chords[n - 1] + before * chords[n]) - after * rights[-1]
        factors.append(before / pivot)
        rights.append(right / pivot)
    slopes = [0.0]
    for factor, right in zip(reversed(factors), reversed(rights), strict=True):
        slopes.append(right - factor * slopes[-1])
    return slopes[::-1]


def _cubic(values: Sequence[float], rates: Sequence[float], t: float, span: float) -> Setpoint:
    """Hermite's cubic between two values with their rates, `t` into a span."""
    (begin, end), (begin_rate, end_rate) = values, rates
    chord = (end - begin) / span
    second = (3.0 * chord - 2.0 * begin_rate - end_rate) / span
    third = (begin_rate + end_rate - 2.0 * chord) / (span * span)
    return Setpoint(
        begin + t * (begin_rate + t * (second + t * third)),
        begin_rate + t * (2.0 * second + 3.0 * t * third),
        2.0 * second + 6.0 * t * third,
    )
