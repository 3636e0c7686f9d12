"""At which end of a robot in two processes a gain is taken up, so that none is set in vain.

A board says by `retune` what its models do with changed settings, and a cut leaves some of them to
the other process. So it is tried: on a robot that is built on absent lines and never run, one key
after another is changed, and the components are named whose state changes with it.
"""

from collections.abc import Iterator
from enum import Enum
from typing import Any

from msgspec import Struct

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import retunable_values, settings_with
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.errors import ConfigError

_State = dict[str, dict[str, object]]
"""The leaves of each component's state by their places, by the component's name."""


def taken_up_elsewhere(board: Board, end: BoardEnd) -> frozenset[str]:
    """The keys that only components of the other end take up.

    A key of which no component changes, as far as that can be seen, is none of them.
    """
    values = retunable_values(board.settings, board.retunable)
    taken = {key: set(_takers(board, key, value)) for key, value in values.items()}
    own = {*end.components}
    return frozenset(key for key, names in taken.items() if names and not names & own)


def _takers(board: Board, key: str, value: object) -> Iterator[str]:
    """The components whose state follows a key."""
    robot = board.unconnected()
    for other in _others(value):
        try:
            settings = settings_with(board, {key: other})
        except ConfigError:
            continue  # out of its range
        before = _state(robot.model)
        robot.retune(settings)
        after = _state(robot.model)
        yield from (name for name, leaves in after.items() if leaves != before.get(name))
        return


def _others(value: object) -> Iterator[object]:
    """Values that a setting may have in place of this one."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield from (value + 1, value - 1)
    elif isinstance(value, float):
        yield from (value * 1.01 + 1e-3, value * 0.99 - 1e-3, value * 0.99)


def _state(model: Coupled) -> _State:
    return {name: dict(_leaves_below(each)) for name, each in model.components.items()}


def _leaves_below(component: Component) -> Iterator[tuple[str, object]]:
    seen: set[int] = set()
    for each in with_all_below(component):
        yield from _leaves(vars(each), each.path, seen)


def _leaves(value: Any, place: str, seen: set[int]) -> Iterator[tuple[str, object]]:  # noqa: ANN401
    """The numbers and texts in a value, however deep, by their places; components are no part."""
    if value is None or isinstance(value, bool | int | float | str | bytes | Enum):
        yield place, value
        return
    if id(value) in seen or isinstance(value, Component | InPort | OutPort):
        return
    seen.add(id(value))
    for name, part in _parts(value):
        yield from _leaves(part, f"{place}.{name}", seen)


def _parts(value: Any) -> Iterator[tuple[object, object]]:  # noqa: ANN401 -- of any type
    if isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, list | tuple):
        yield from enumerate(value)
    elif isinstance(value, Struct):
        yield from ((name, getattr(value, name, None)) for name in value.__struct_fields__)
    else:
        yield from getattr(value, "__dict__", {}).items()
