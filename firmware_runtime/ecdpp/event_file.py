"""Event files: inputs of the top model, `HH:MM:SS:ms Port Value`, one or several on a line.

As CD++ does, events are sorted by time; those of one instant stay in the order of the file. The
value is a whole number or a decimal, with an exponent or without; a port of int takes whole numbers
only, a port of bool 0 and 1. The value `?` of CD++ is undefined: no number, so nothing arrives, and
a warning says so. See the package for comments and case.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort
from firmware_runtime.ecdpp.file_text import (
    Warnings,
    is_carried,
    lines_of,
    look_up,
    parse_number,
    parse_time,
    read_text,
)
from firmware_runtime.errors import ConfigError

UNDEFINED = "?"
"""The value that CD++ has for a signal without one."""


class Event(NamedTuple):
    """A value for an input port of the top model at an instant (ns)."""

    at: int
    port: str
    value: float | bool


def read_events(path: Path, model: Component, warnings: Warnings | None = None) -> list[Event]:
    """The file's events for this model; raises ConfigError with every faulty line."""
    warnings = warnings or Warnings()
    return parse_events(read_text(path, warnings), str(path), model, warnings)


def parse_events(
    text: str, source: str, model: Component, warnings: Warnings | None = None
) -> list[Event]:
    """The text's events; `source` names it in a ConfigError."""
    warnings = warnings or Warnings()
    events: list[Event] = []
    faults: list[str] = []
    for number, line in lines_of(text):
        fields = line.split()
        if len(fields) % 3:
            fault = f"{line!r}: expected HH:MM:SS:ms Port Value, once or several times"
            faults.append(f"line {number}: {fault}")
            continue
        for place in range(0, len(fields), 3):
            time, name, value = fields[place : place + 3]
            try:
                event = _event(time, name, value, model.in_ports)
            except ValueError as error:
                faults.append(f"line {number}: {error}")
                continue
            if is_carried(time):
                warnings.note(number, f"time {time}", "what is above 59 is carried over")
            if event is None:
                warnings.note(number, f"{name} ?", "undefined; nothing arrives")
            else:
                events.append(event)
    if faults:
        raise ConfigError(source, faults)
    return sorted(events, key=lambda event: event.at)


def _event(time: str, name: str, value: str, ports: Mapping[str, InPort[object]]) -> Event | None:
    """The event of three fields; raises ValueError with a sentence that says what is wrong.

    None for a value that is undefined.
    """
    at = parse_time(time)
    if at is None:
        raise ValueError(f"time {time!r}: expected HH:MM:SS:ms, such as 00:00:02:500")
    port = look_up(ports, name)
    if port is None:
        known = ", ".join(ports) or "none: the model has no inputs"
        raise ValueError(f"unknown port {name!r}; expected one of {known}")
    return None if value == UNDEFINED else Event(at, port.name, _value(value, port))


def _value(text: str, port: InPort[object]) -> float | bool:
    number = parse_number(text)
    if number is None:
        raise ValueError(f"value {text!r}: expected a number, such as 1 or 200.5")
    if port.type is float:
        return number
    if port.type is int and number.is_integer():
        return int(number)
    if port.type is bool and number in {0, 1}:
        return bool(number)
    raise ValueError(f"value {text!r}: port {port.name!r} carries {port.type.__name__}")
