"""Buses and ports that a board file describes and no device is on: tables without effect."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

from msgspec import Struct, structs

from firmware_runtime.board.lines import Lines, absent_lines
from firmware_runtime.board.settings import BoardSettings

L = TypeVar("L")


class _Noted(Mapping[str, L]):
    """Lines by their names, and which of them were taken."""

    def __init__(self, lines: Mapping[str, L]) -> None:
        self._lines = lines
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> L:
        self.names.add(name)
        return self._lines[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._lines)

    def __len__(self) -> int:
        return len(self._lines)


def unused_lines(
    settings: BoardSettings,
    build: Callable[[Lines], object] | None,
) -> list[str]:
    """The tables of lines that no other table names and that the robot does not take.

    `build` is None where settings have faults already: then names alone decide. Otherwise the robot
    is built if a line is not named: its wiring may know the name by itself.
    """
    used = set(_texts(settings))
    if build is not None and not used.issuperset([*settings.buses, *settings.ports]):
        used |= _taken([*settings.buses], [*settings.ports], build)
    return [
        f"{table}.{name}: has no effect; no device is on it"
        for table, names in (("buses", settings.buses), ("ports", settings.ports))
        for name in names
        if name not in used
    ]


def _taken(
    buses: Sequence[str], ports: Sequence[str], build: Callable[[Lines], object]
) -> set[str]:
    """The lines that a robot takes while it is built; all, if it cannot be built."""
    absent = absent_lines(buses, ports)
    noted_buses, noted_ports = _Noted(absent.buses), _Noted(absent.ports)
    try:
        build(Lines(noted_buses, noted_ports))
    except Exception:  # noqa: BLE001 -- a defect of its package, named where the robot is needed
        return {*buses, *ports}
    return noted_buses.names | noted_ports.names


def _texts(value: object) -> Iterator[str]:
    """Every text in settings, at any depth."""
    if isinstance(value, str):
        yield value
        return
    if isinstance(value, Struct):
        value = structs.asdict(value)
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        for each in value:
            yield from _texts(each)
