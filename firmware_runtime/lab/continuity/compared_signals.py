"""What a stage's recordings show over time: the board's shown value, and the commands."""

from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from typing import Final, NamedTuple

from firmware_runtime.board.ends import role_without_hardware
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import rig_for, shown_by
from firmware_runtime.board.roles import components_of, crossings
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.typed_values import (
    Sent,
    model_of,
    ports_of,
    sections_between,
    values_in,
)
from firmware_runtime.statistics.json_values import plain

Points = list[tuple[float, float]]

MOST_CURVES: Final = 4


class Signals(NamedTuple):
    """Ports of a board by path below the root, as they go by in its recordings."""

    shown: str | None
    """What a person wants to see over time; None where the board's rig shows nothing."""
    commands: tuple[str, ...]
    """What leaves the role that computes; none of a board without roles."""


def signals_of(board: Board) -> Signals:
    """What is drawn of a board. Raises ConfigError for one without a rig."""
    model, roles = board.unconnected().model, board.settings.roles
    senders, own = Senders(model), list[str]()
    if roles:
        own += components_of(roles, model, role_without_hardware(board))
    leaving = (each for each in sorted(crossings(roles, model)) if each.partition(".")[0] in own)
    commands = dict.fromkeys(sender for each in leaving for sender in senders.of(each))
    rig = rig_for(board, WorldClock())
    rig.attach(model)
    port = shown_by(rig, board)
    return Signals(None if port is None else below_root(port.path), tuple(commands))


def shown(recording: Recording, port: str | None) -> Points:
    """What the shown port sent: s, and the port's unit."""
    sent = _sent(recording, {port} if port is not None else ())
    return [(each.at / SECOND, each.value) for each in sent if isinstance(each.value, float)]


def commands(recording: Recording, ports: Collection[str]) -> dict[str, Points]:
    """What these ports sent, a curve for each number in it, each held until the next."""
    short, curves = _short(list(ports)), dict[str, Points]()
    for each in _sent(recording, ports):
        for leaf, value in numbers_in(plain(each.value), short[each.port]):
            _hold(curves.setdefault(leaf, []), each.at / SECOND, value)
    return dict(islice(curves.items(), MOST_CURVES))


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


def _sent(recording: Recording, wanted: Collection[str]) -> Iterator[Sent]:
    """What these ports sent, in order."""
    header = recording.header
    ports = ports_of(model_of(header, board_of(header)))
    for section in sections_between(recording, 0, NEVER):
        for each in values_in(section, header.ports, ports):
            if each.port in wanted:
                yield each


def _short(names: list[str]) -> Mapping[str, str]:
    """Names of ports without their components, where they are unique without."""
    ports = [name.rpartition(".")[2] for name in names]
    return dict(zip(names, ports if len(set(ports)) == len(ports) else names, strict=True))


def _hold(points: Points, at: float, value: float) -> None:
    if points and points[-1][1] != value:
        points.append((at, points[-1][1]))
    points.append((at, value))
