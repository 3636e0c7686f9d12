"""What a recording shows over time: the board's shown value, the commands, the age of samples."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any, Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.records import Entered, Left, Shown
from firmware_runtime.recording.values import UnknownValue, made
from firmware_runtime.statistics.quantile import quantile
from firmware_runtime.statistics.trace_file import plain as shown_form

Points = list[tuple[float, float]]

MOST_CURVES: Final = 4


def shown(recording: Recording) -> Points:
    """The values of the port that a person wants to see: s, and the port's unit."""
    return [(each.at / SECOND, each.value) for each in recording.records if isinstance(each, Shown)]


def commands(recording: Recording) -> dict[str, Points]:
    """What left the controller, a curve for each number in it, each held until the next."""
    short = _short(list(recording.header.leaving))
    curves: dict[str, Points] = {}
    for record in recording.records:
        if isinstance(record, Left):
            for leaf, value in numbers_in(_value(record), short[record.name]):
                _hold(curves.setdefault(leaf, []), record.at / SECOND, value)
    return dict(islice(curves.items(), MOST_CURVES))


def ages(recording: Recording) -> dict[str, Points]:
    """How old samples were when they entered, ms, by crossing; none without a link."""
    crossings = recording.header.crossings
    curves: dict[str, Points] = {}
    for record in recording.records:
        if isinstance(record, Entered) and record.age is not None:
            points = curves.setdefault(crossings[record.name], [])
            points.append((record.at / SECOND, record.age / MILLISECOND))
    return curves


def quantiles_us(recording: Recording) -> dict[str, dict[str, float]] | None:
    """Age of samples when they entered, by crossing: p50, p99 and the greatest; None without."""
    found = {
        name: _quantiles(sorted(value for _, value in points))
        for name, points in ages(recording).items()
    }
    return found or None


def numbers_in(value: object, name: str) -> Iterator[tuple[str, float]]:
    """The numbers that a value holds, with their names."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from numbers_in(each, f"{name}.{key}")
    elif isinstance(value, list):
        for number, each in enumerate(value):
            yield from numbers_in(each, f"{name}[{number}]")
    elif isinstance(value, int | float):  # a truth value is 0 or 1
        yield name, float(value)


def _short(names: list[str]) -> list[str]:
    """Names of ports without their components, where they are unique without."""
    ports = [name.rpartition(".")[2] for name in names]
    return ports if len(set(ports)) == len(ports) else names


def _hold(points: Points, at: float, value: float) -> None:
    if points and points[-1][1] != value:
        points.append((at, points[-1][1]))
    points.append((at, value))


def _quantiles(ages_ms: Sequence[float]) -> dict[str, float]:
    shares = {"p50": 0.5, "p99": 0.99, "max": 1.0}
    found = {name: quantile(ages_ms, share) for name, share in shares.items()}
    measured = {name: round(1000 * age, 1) for name, age in found.items() if age is not None}
    return {**measured, "count": len(ages_ms)}


def _value(record: Left) -> Any:  # noqa: ANN401 -- whatever left
    try:
        return shown_form(made(record.value))
    except UnknownValue:
        return None
