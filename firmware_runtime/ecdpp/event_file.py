"""Event files: inputs of the top model, `HH:MM:SS:ms Port Value`, one or several on a line.

As CD++ does, events are sorted by time; those of one instant stay in the order of the file. The
value is a whole number or a decimal; a port of int takes whole numbers only, a port of bool 0 and
1. See the package for comments and case.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import InPort
from firmware_runtime.ecdpp.text import lines_of, look_up, parse_number, parse_time
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_file import read_text


class Event(NamedTuple):
    """A value for an input port of the top model at an instant (ns)."""

    at: int
    port: str
    value: float | bool


def read_events(path: Path, model: Component) -> list[Event]:
    """The file's events for this model; raises ConfigError with every faulty line."""
    return parse_events(read_text(path), str(path), model)


def parse_events(text: str, source: str, model: Component) -> list[Event]:
    """The text's events; `source` names it in a ConfigError."""
    events: list[Event] = []
    faults: list[str] = []
    for number, line in lines_of(text):
        fields = line.split()
        if len(fields) % 3:
            fault = f"{line!r}: expected HH:MM:SS:ms Port Value, once or several times"
            faults.append(f"line {number}: {fault}")
            continue
        for place in range(0, len(fields), 3):
            try:
                events.append(_event(fields[place : place + 3], model.in_ports))
            except ValueError as error:
                faults.append(f"line {number}: {error}")
    if faults:
        raise ConfigError(source, faults)
    return sorted(events, key=lambda event: event.at)


def _event(fields: Sequence[str], ports: Mapping[str, InPort[Any]]) -> Event:
    """The event of three fields; raises ValueError with a sentence that says what is wrong."""
    time, name, value = fields
    at = parse_time(time)
    if at is None:
        raise ValueError(f"time {time!r}: expected HH:MM:SS:ms, such as 00:00:02:500")
    port = look_up(ports, name)
    if port is None:
        known = ", ".join(ports) or "none: the model has no inputs"
        raise ValueError(f"unknown port {name!r}; expected one of {known}")
    return Event(at, port.name, _value(value, port))


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
