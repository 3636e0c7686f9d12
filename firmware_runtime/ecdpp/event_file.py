"""Event files: one input of the top model a line, `HH:MM:SS:ms Port Value`, in order of time.

The value is a whole number or a decimal; a port of int takes whole numbers only, a port of bool 0
and 1. See the package for comments and case.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort
from firmware_runtime.ecdpp.text import (
    format_time,
    lines_of,
    look_up,
    parse_number,
    parse_time,
    read_text,
)
from firmware_runtime.errors import BoardError


class Event(NamedTuple):
    """A value for an input port of the top model at an instant (ns)."""

    at: int
    port: str
    value: float | bool


def read_events(path: Path, model: Component) -> list[Event]:
    """The file's events for this model; raises BoardError with every faulty line."""
    return parse_events(read_text(path), str(path), model)


def parse_events(text: str, source: str, model: Component) -> list[Event]:
    """The text's events; `source` names it in a BoardError."""
    events: list[Event] = []
    faults: list[str] = []
    latest = 0
    for number, line in lines_of(text):
        try:
            event = _event(line, model.in_ports, latest)
        except ValueError as error:
            faults.append(f"line {number}: {error}")
        else:
            latest = event.at
            events.append(event)
    if faults:
        raise BoardError(source, faults)
    return events


def _event(line: str, ports: Mapping[str, InPort[Any]], latest: int) -> Event:
    """The event on a line; raises ValueError with a sentence that says what is wrong."""
    fields = line.split()
    if len(fields) != 3:
        raise ValueError(f"{line!r}: expected HH:MM:SS:ms Port Value")
    at = parse_time(fields[0])
    if at is None:
        raise ValueError(f"time {fields[0]!r}: expected HH:MM:SS:ms, such as 00:00:02:500")
    if at < latest:
        raise ValueError(
            f"time {fields[0]} goes backwards; expected {format_time(latest)} or later"
        )
    port = look_up(ports, fields[1])
    if port is None:
        known = ", ".join(ports) or "none: the model has no inputs"
        raise ValueError(f"unknown port {fields[1]!r}; expected one of {known}")
    return Event(at, port.name, _value(fields[2], port))


def _value(text: str, port: InPort[Any]) -> float | bool:
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
