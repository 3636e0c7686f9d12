"""What left which port in a run, of its recording or a trace."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox import reader
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.typed_values import (
    entered_in,
    model_of,
    ports_of,
    sections_between,
    values_in,
)


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


def recorded(path: Path) -> Iterator[Event]:
    """Of the recording that every run leaves, with what came in over a link. Raises ConfigError."""
    recording = reader.read_recording(path)
    header = recording.header
    model = model_of(header, board_of(header))
    ports = ports_of(model)
    for section in sections_between(recording, 0, NEVER):
        for each in entered_in(section, model.in_ports):
            yield Event(each.at / 1e9, each.port, each.value)
        for each in values_in(section, header.ports, ports):
            yield Event(each.at / 1e9, each.port, each.value)


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
