"""How the content of a built-in class is read as plain values, and set in place.

Reading makes a new object every time: what the pickler knows by identity, it would refer to.
"""

import array
import random
import sys
import types
from collections import OrderedDict, deque
from collections.abc import Callable
from typing import Any, Final, TypeAlias

from msgspec import Struct

Thing: TypeAlias = Any
"""An object of the class in question."""

EMPTY: Final = ()
"""The content of a cell that is not filled; that of another is a tuple of one."""


class Content(Struct, frozen=True):
    """Reads the content of an object, and sets it."""

    read: Callable[[Thing], Thing]
    fill: Callable[[Thing, Thing], None]


def content_of(base: type[Thing]) -> Content | None:
    """What reads and sets the content of a built-in class; None if it has none or is unknown."""
    if base in _CONTENTS:
        return _CONTENTS[base]
    if base.__module__ == "collections" and base.__name__ == "defaultdict":
        return _CONTENTS[dict]
    numpy: Any = sys.modules.get("numpy")
    if numpy is not None and base is numpy.ndarray:
        return Content(_array_bytes, _fill_array)
    generators: Any = sys.modules.get("numpy.random.bit_generator")
    if generators is not None and issubclass(base, generators.BitGenerator):
        return Content(_generator_state, _set_generator)
    return None


def shown(thing: Thing, content: Thing) -> Thing:
    """A content as it is compared: items of arrays one by one, those of a set without order."""
    if isinstance(thing, set):
        return set(content)
    if isinstance(thing, array.array):
        return array.array(thing.typecode, content).tolist()
    numpy: Any = sys.modules.get("numpy")
    if numpy is not None and isinstance(thing, numpy.ndarray):
        *shape, numbers = content
        return numpy.frombuffer(numbers, thing.dtype).reshape(shape).tolist()
    return content


def _fill_list(thing: list[object], content: list[object]) -> None:
    list.__setitem__(thing, slice(None), content)


def _fill_dict(thing: dict[object, object], content: dict[object, object]) -> None:
    dict.clear(thing)
    dict.update(thing, content)


def _fill_ordered(thing: OrderedDict[object, object], content: list[tuple[object, ...]]) -> None:
    OrderedDict.clear(thing)
    for key, value in content:
        OrderedDict.__setitem__(thing, key, value)


def _fill_set(thing: set[object], content: list[object]) -> None:
    set.clear(thing)
    set.update(thing, content)


def _fill_deque(thing: deque[object], content: list[object]) -> None:
    deque.clear(thing)
    deque.extend(thing, content)


def _fill_bytes(thing: bytearray, content: bytes) -> None:
    if len(thing) == len(content):  # a view of it keeps it from being resized, by itself as well
        memoryview(thing)[:] = content
    else:
        bytearray.__setitem__(thing, slice(None), content)


def _fill_numbers(thing: "array.array[Any]", content: bytes) -> None:
    if len(thing) * thing.itemsize == len(content):
        memoryview(thing).cast("B")[:] = content
    else:
        del thing[:]
        thing.frombytes(content)


def _cell(thing: types.CellType) -> tuple[object, ...]:
    try:
        return (thing.cell_contents,)
    except ValueError:
        return EMPTY


def _fill_cell(thing: types.CellType, content: tuple[object, ...]) -> None:
    if content:
        (thing.cell_contents,) = content
    elif _cell(thing):
        del thing.cell_contents


def _array_bytes(thing: Thing) -> tuple[object, ...]:
    return (*thing.shape, thing.tobytes())


def _fill_array(thing: Thing, content: tuple[Any, ...]) -> None:
    *shape, numbers = content
    if tuple(shape) != thing.shape:
        # The memory of as many items stays where it is, if they lie side by side.
        if len(numbers) != thing.nbytes or not thing.flags.forc:
            raise TypeError(f"an array of shape {thing.shape} that had shape {tuple(shape)}")
        thing.resize(shape, refcheck=False)
    is_writeable = thing.flags.writeable
    if not is_writeable:
        try:
            thing.flags.writeable = True
        except ValueError:  # a view of what is not to be written to: it has what that has
            return
    thing[...] = sys.modules["numpy"].frombuffer(numbers, thing.dtype).reshape(shape)
    if not is_writeable:
        thing.flags.writeable = False


def is_array_of_objects(thing: Thing) -> bool:
    """Whether it is an array of numpy whose items are objects."""
    numpy: Any = sys.modules.get("numpy")
    return numpy is not None and isinstance(thing, numpy.ndarray) and bool(thing.dtype.hasobject)


def _generator_state(thing: Thing) -> Thing:
    state = thing.state
    if spawned := _spawned_by(thing):
        state["spawned"] = spawned
    return state


def _set_generator(thing: Thing, content: dict[str, object]) -> None:
    if content.get("spawned", 0) != _spawned_by(thing):  # numpy counts them, and sets no count
        raise TypeError("a generator that others have been spawned from since it was made")
    thing.state = content


def _spawned_by(generator: Thing) -> int:
    spawned: int = getattr(generator.seed_seq, "n_children_spawned", 0)
    return spawned


_RANDOM: Final = random.Random.__mro__[1]
"""Holds the generator's words; `random.Random` adds an attribute to it."""

_CONTENTS: Final[dict[type[Any], Content]] = {
    list: Content(list.copy, _fill_list),
    dict: Content(dict.copy, _fill_dict),
    OrderedDict: Content(lambda thing: list(OrderedDict.items(thing)), _fill_ordered),
    set: Content(lambda thing: list(set.__iter__(thing)), _fill_set),
    deque: Content(lambda thing: list(deque.__iter__(thing)), _fill_deque),
    bytearray: Content(bytes, _fill_bytes),
    array.array: Content(lambda thing: thing.tobytes(), _fill_numbers),
    types.CellType: Content(_cell, _fill_cell),
    _RANDOM: Content(_RANDOM.getstate, _RANDOM.setstate),  # type: ignore[attr-defined]
}
