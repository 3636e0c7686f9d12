"""What left which port in a run: of a recording, the kept one or that of `--record`, or a trace."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from firmware_runtime.blackbox import reader
from firmware_runtime.blackbox.found import find_recording, is_black_box
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.exports.typed_values import (
    model_of,
    ports_of,
    sections_between,
    values_in,
)
from firmware_runtime.part_recording.recording import read_recording
from firmware_runtime.part_recording.records import Entered, Left
from firmware_runtime.recording.of_board import board_of


class Event(NamedTuple):
    """A value that left a port at an instant of the run, s."""

    at_s: float
    port: str
    value: Any


def file_of(run: str) -> Path:
    """The file that is meant: its path, or as for `replay` a board's last run, or one kept.

    Raises ConfigError if there is none.
    """
    path = Path(run)
    return path if path.is_file() else find_recording(run)


def is_kept_recording(path: Path) -> bool:
    """Whether it is the recording that every run leaves."""
    return is_black_box(path)


def kept(path: Path) -> Iterator[Event]:
    """Of the recording that every run leaves. Raises ConfigError."""
    recording = reader.read_recording(path)
    header = recording.header
    ports = ports_of(model_of(header, board_of(header)))
    for section in sections_between(recording, 0, NEVER):
        for sent in values_in(section, header.ports, ports):
            yield Event(sent.at / 1e9, sent.port, sent.value)


def recorded(path: Path) -> Iterator[Event]:
    """Of a file of `run --record`. Raises ConfigError."""
    recording = read_recording(path)
    header = recording.header
    entering, leaving = list(header.entering), list(header.leaving)
    for record in recording.records:
        if isinstance(record, Entered | Left):
            names = entering if isinstance(record, Entered) else leaving
            yield Event(record.at / 1e9, names[record.name], record.value)


def traced(path: Path) -> Iterator[Event]:
    """Of a file of `run --trace`. Raises ConfigError."""
    with path.open() as file:
        for number, line in enumerate(file, 1):
            try:
                message = json.loads(line)
                yield Event(message["t_ns"] / 1e9, message["port"], message["value"])
            except (ValueError, KeyError, TypeError) as error:
                fault = f"line {number} is no message of a trace; expected t_ns, port and value"
                raise ConfigError.of_one(str(path), fault) from error
