"""Source of a series: a recording, a trace, or a table of numbers, told apart by content.

A signal's port may be a coupled model's: what left it goes by the atomic that sent it.

A table is CSV with a head line that has `time_s`, `input` and `output`, all in SI; an instant
without a new input, or without a measurement, has an empty cell there.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta, Struct

from firmware_runtime.board.experiments import Plant, Signal
from firmware_runtime.board.registry import Board
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.identification.recorded_series import Quantity, Series, checked
from firmware_runtime.recording.blackbox.locations import find_recording, is_black_box
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.typed_values import Sent, passed
from firmware_runtime.statistics.json_values import NOT_JSON


class _Traced(Struct):
    """A line of a trace."""

    t_ns: Annotated[int, Meta(lt=NEVER)]
    port: str
    value: Any


def traced(path: Path) -> Iterator[Sent]:
    """Values of a file of `run --trace`. Raises ConfigError."""
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            try:
                message = msgspec.json.decode(line, type=_Traced)
            except NOT_JSON as error:
                fault = f"line {number} is no message of a trace; expected t_ns, port and value"
                raise ConfigError.of_one(str(path), fault) from error
            yield Sent(message.t_ns, message.port, message.value)


COLUMNS: Final = ("time_s", "input", "output")


class _Pair(NamedTuple):
    given: dict[float, float]
    measured: dict[float, float]


def read_series(run: str | Path, board: Board, since_s: float | None = None) -> Series:
    """Read the series of the board's plant in a run. Raises ConfigError with every fault."""
    plant, path = plant_of(board), Path(run)
    if not path.is_file():
        path = find_recording(str(run))
    try:
        with path.open("rb") as file:
            begin = file.read(1)
    except OSError as error:
        fault = f"cannot be read ({error.strerror}); expected a recording, a trace or a table"
        raise ConfigError.of_one(str(path), fault) from error
    if is_black_box(path):
        recording = read_recording(path)
        sent = list(passed(recording, board_of(recording.header)))
        pair = _of_events(path, sent, board, plant)
    elif begin == b"{":
        pair = _of_events(path, list(traced(path)), board, plant)
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


def _of_events(path: Path, events: Sequence[Sent], board: Board, plant: Plant) -> _Pair:
    """Both signals; of several values at one instant the last counts."""
    sent = {each.port for each in events}
    chosen = [_present(signal, sent, board) for signal in (plant.input, plant.output)]
    faults = [
        f"nothing of {' or '.join(signal.ports)}, which {plant.title} is identified by; expected "
        "it, as in the recording of a whole run: that of one end has its own ports only"
        for signal, names in zip((plant.input, plant.output), chosen, strict=True)
        if not names
    ]
    if faults:
        raise ConfigError(str(path), faults)
    found: tuple[dict[float, float], ...] = ({}, {})
    for signal, names, values in zip((plant.input, plant.output), chosen, found, strict=True):
        scale = signal.scale(board.settings)
        for each in events:
            if each.port in names:
                values[each.at / SECOND] = scale * _number(path, signal, each.value)
    return _Pair(*found)


def _present(signal: Signal, sent: set[str], board: Board) -> set[str]:
    """The names under which the first of the signal's ports is there, if any is."""
    for port in signal.ports:
        if port in sent:
            return {port}
    senders = Senders(board.unconnected().model)
    found = ({name for name in sent if senders.carry(port, name)} for port in signal.ports)
    return next(filter(None, found), set())


def _number(path: Path, signal: Signal, value: object) -> float:
    total = 0.0
    for place, weight in signal.terms.items():
        try:
            found = float(_at_place(value, place))
        except (LookupError, AttributeError, TypeError, ValueError, OverflowError) as error:
            fault = f"no number at {place or 'a value'} of {signal.ports[0]}; expected one"
            raise ConfigError.of_one(str(path), fault) from error
        total += weight * found
    return total


def _at_place(value: Any, place: str) -> Any:  # noqa: ANN401
    for word in filter(None, place.split(".")):
        if isinstance(value, Mapping):
            value = value[word]
        elif word.isdigit():
            value = value[int(word)]
        else:
            value = getattr(value, word)
    return value


def _of_table(path: Path) -> _Pair:
    try:
        with path.open(newline="") as file:
            rows = csv.DictReader(file)
            missing = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
            if missing:
                fault = f"no recording, no trace, and no table: no column {', '.join(missing)}"
                raise ConfigError(str(path), [f"{fault}; expected {', '.join(COLUMNS)}"])
            return _pair_of(path, rows)
    except (UnicodeDecodeError, csv.Error) as error:
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
