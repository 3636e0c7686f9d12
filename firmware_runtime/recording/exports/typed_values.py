"""The values in a recording, as they came in and as the run's models sent them, by port and type.

A recording holds a named tuple as its items and a record as its fields; the port's type says which
it was. Where it does not, such as for a port of any tuple, the value stays as it is recorded.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import msgspec

from firmware_runtime.board.ends import end_of, robot_of
from firmware_runtime.board.registry import Board
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import Section, decode, sent_of
from firmware_runtime.recording.blackbox.taps import output_ports, own_atomics
from firmware_runtime.recording.records import UnknownValue
from firmware_runtime.recording.values import made, numbers_in

Port: TypeAlias = OutPort[object]


class Sent(NamedTuple):
    """A value that left a port at an instant of the run, ns, or came in by one from outside."""

    at: int
    port: str
    value: object


def model_of(header: Header, board: Board) -> Coupled:
    """The model that ran, built on no lines. Raises ConfigError."""
    whole = board.unconnected()
    if header.role is None:
        return whole.model
    robot, _ = robot_of(end_of(board, header.role), whole)
    return robot.model


def ports_of(model: Coupled) -> dict[str, Port]:
    """The output ports of its atomics by path below the root."""
    return {below_root(port.path): port for port in output_ports(own_atomics(model))}


def sections_between(recording: Recording, begin: int, until: int) -> Iterator[Section]:
    """Its sections that have an instant, from one instant up to and including another."""
    for section in map(decode, recording.contents()):
        if section.has_instant and begin <= section.at <= until:
            yield section


def values_in(section: Section, paths: Sequence[str], ports: Mapping[str, Port]) -> Iterator[Sent]:
    """Yield what left ports in a section, in the order in which it was sent."""
    for number, form in sent_of(section):
        path = paths[number] if 0 <= number < len(paths) else str(number)
        yield Sent(section.at, path, value_at(form, ports.get(path)))


def entered_in(section: Section, entrances: Mapping[str, InPort[object]]) -> Iterator[Sent]:
    """Yield what came in from outside in a section, by input ports of the top model."""
    for name, form in section.entered:
        yield Sent(section.at, entrance(name), value_at(form, entrances.get(name)))


def entrance(name: str) -> str:
    """An input port by the name of what it carries: `imu.sample` came in over a link.

    The part of a robot that takes it in has a port `imu:sample`, since a name has no dot.
    """
    return name.replace(":", ".")


def passed(
    recording: Recording,
    board: Board,
    begin: int = 0,
    until: int = NEVER,
    ports: Mapping[str, Port] | None = None,
) -> Iterator[Sent]:
    """Values that came in from outside and that left ports, in order. Raises ConfigError.

    `ports` are those of the run itself, with its world's, where that is at hand.
    """
    header, model = recording.header, model_of(recording.header, board)
    ports = ports_of(model) if ports is None else ports
    for section in sections_between(recording, begin, until):
        yield from entered_in(section, model.in_ports)
        yield from values_in(section, header.ports, ports)


def typed(form: object, kind: object) -> object:
    """The value of this type that was recorded as `form`."""
    for each in (form, numbers_in(form)):
        try:
            return msgspec.convert(each, kind)
        except (msgspec.ValidationError, TypeError):
            continue
    return _made(form)


def value_at(form: object, port: Port | InPort[object] | None) -> object:
    """The value that was recorded as `form` at a port, or at one that is not known."""
    return _made(form) if port is None else typed(form, port.type)


def _made(form: object) -> object:
    try:
        return made(form)
    except UnknownValue:
        return numbers_in(form)
