"""Where a series comes from: a recording, a trace, or a table of numbers, told apart by content.

A table is CSV with a head line that has `time_s`, `input` and `output`, all in SI; an instant
without a new input, or without a measurement, has an empty cell there.
"""

import csv
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from firmware_runtime.board.plants import Plant, Signal
from firmware_runtime.board.registry import Board
from firmware_runtime.errors import ConfigError
from firmware_runtime.identification.series import Quantity, Series, checked
from firmware_runtime.recording.frames import MAGIC
from firmware_runtime.recording.recording import read_recording
from firmware_runtime.recording.records import Entered, Left
from firmware_runtime.recording.values import UnknownValue, made

COLUMNS: Final = ("time_s", "input", "output")


class _Pair(NamedTuple):
    given: dict[float, float]
    measured: dict[float, float]


def read_series(path: Path, board: Board, since_s: float | None = None) -> Series:
    """What a file says of the board's plant. Raises ConfigError with every fault."""
    plant = plant_of(board)
    try:
        with path.open("rb") as file:
            begin = file.read(len(MAGIC))
    except OSError as error:
        fault = f"cannot be read ({error.strerror}); expected a recording, a trace or a table"
        raise ConfigError.of_one(str(path), fault) from error
    if begin == MAGIC:
        pair = _of_events(path, list(_recorded(path)), board, plant)
    elif begin[:1] == b"{":
        pair = _of_events(path, list(_traced(path)), board, plant)
    else:
        pair = _of_table(path)
    series = _series(pair, plant.measures)
    return checked(series if since_s is None else series.since(since_s), str(path))


def plant_of(board: Board) -> Plant:
    """The body that a board says it moves. Raises ConfigError for one that says of none."""
    if board.plant is None:
        fault = "its definition names no plant; expected `plant=Plant(...)`, a body with friction"
        raise ConfigError(board.name, [fault])
    return board.plant


def _series(pair: _Pair, quantity: Quantity) -> Series:
    given, measured = sorted(pair.given.items()), sorted(pair.measured.items())
    return Series(
        np.array([at for at, _ in given]),
        np.array([value for _, value in given]),
        np.array([at for at, _ in measured]),
        np.array([value for _, value in measured]),
        quantity,
    )


def _recorded(path: Path) -> Iterator[tuple[float, str, Any]]:
    recording = read_recording(path)
    header = recording.header
    entering, leaving = list(header.entering), list(header.leaving)
    for record in recording.records:
        if isinstance(record, Entered | Left):
            names = entering if isinstance(record, Entered) else leaving
            yield record.at / 1e9, names[record.name], record.value


def _traced(path: Path) -> Iterator[tuple[float, str, Any]]:
    with path.open() as file:
        for number, line in enumerate(file, 1):
            try:
                message = json.loads(line)
                yield message["t_ns"] / 1e9, message["port"], message["value"]
            except (ValueError, KeyError, TypeError) as error:
                fault = f"line {number} is no message of a trace; expected t_ns, port and value"
                raise ConfigError.of_one(str(path), fault) from error


def _of_events(
    path: Path, events: Sequence[tuple[float, str, Any]], board: Board, plant: Plant
) -> _Pair:
    """Both signals; of several values at one instant the last counts."""
    ports = {port for _, port, _ in events}
    chosen = [_present(signal, ports) for signal in (plant.input, plant.output)]
    faults = [
        f"nothing of {' or '.join(signal.ports)}, which {plant.title} is identified by; expected it"
        for signal, port in zip((plant.input, plant.output), chosen, strict=True)
        if port is None
    ]
    if faults:
        raise ConfigError(str(path), faults)
    found: tuple[dict[float, float], ...] = ({}, {})
    for signal, port, values in zip((plant.input, plant.output), chosen, found, strict=True):
        scale = signal.scale(board.settings)
        for at, name, value in events:
            if name == port:
                values[at] = scale * _number(path, signal, value)
    return _Pair(*found)


def _present(signal: Signal, ports: set[str]) -> str | None:
    return next((port for port in signal.ports if port in ports), None)


def _number(path: Path, signal: Signal, value: Any) -> float:  # noqa: ANN401 -- any port's
    total = 0.0
    for place, weight in signal.terms.items():
        try:
            found = float(_at_place(value, place))
        except (LookupError, AttributeError, TypeError, ValueError, UnknownValue) as error:
            fault = f"no number at {place or 'a value'} of {signal.ports[0]}; expected one"
            raise ConfigError.of_one(str(path), fault) from error
        total += weight * found
    return total


def _at_place(value: Any, place: str) -> Any:  # noqa: ANN401
    value = made(value) if _is_tagged(value) else value
    for word in filter(None, place.split(".")):
        if isinstance(value, Mapping):
            value = value[word]
        elif word.isdigit():
            value = value[int(word)]
        else:
            value = getattr(value, word)
    return value


def _is_tagged(value: object) -> bool:
    """Whether this is how a recording writes an object of a class."""
    return isinstance(value, dict) and len(value) == 1 and ":" in next(iter(value))


def _of_table(path: Path) -> _Pair:
    try:
        with path.open(newline="") as file:
            rows = csv.DictReader(file)
            missing = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
            if missing:
                fault = f"no recording, no trace, and no table: no column {', '.join(missing)}"
                raise ConfigError(str(path), [f"{fault}; expected {', '.join(COLUMNS)}"])
            return _pair_of(path, rows)
    except UnicodeDecodeError as error:
        fault = "neither a recording, a trace nor a table; expected one of these"
        raise ConfigError.of_one(str(path), fault) from error


def _pair_of(path: Path, rows: Iterable[Mapping[str, str | None]]) -> _Pair:
    pair, faults = _Pair({}, {}), []
    for number, row in enumerate(rows, 2):
        try:
            at = float(row["time_s"] or "")
            for name, values in (("input", pair.given), ("output", pair.measured)):
                if cell := (row[name] or "").strip():
                    values[at] = float(cell)
        except ValueError:
            faults.append(f"line {number}: {', '.join(map(str, row.values()))}: expected numbers")
    if faults:
        raise ConfigError(str(path), faults[:20])
    return pair
