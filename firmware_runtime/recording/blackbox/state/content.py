"""Rows of containers: what each holds, and what it is to hold."""

import random
from array import array
from collections import deque
from contextlib import suppress
from operator import is_
from typing import Any, Final
from zlib import crc32

from firmware_runtime.errors import text_of
from firmware_runtime.recording.blackbox.state.rows import (
    AS_BUILT,
    SCALARS,
    Check,
    Fields,
    Forms,
    NumberOf,
    Row,
)
from firmware_runtime.recording.blackbox.state.walk import Thing, UnkeepableState
from firmware_runtime.recording.records import UnknownValue
from firmware_runtime.recording.values import Plain, Reader, Writer, pack


class Content(Row):
    """Of a container: what it holds."""

    def __init__(self, path: str, thing: Thing) -> None:
        super().__init__(path, thing)
        self._built = _items(thing)
        self._form: Plain = AS_BUILT
        self._packed: bytes | None = None

    def keep_built(self, number_of: NumberOf) -> list[Check]:
        """Keep what it was built with, as a form, where it has one."""
        with suppress(UnknownValue):
            form = Writer(number_of).content(self.thing)
            # of a generator without a seed only the file knows how it was built
            self._form, self._packed = form, None if _is_generator(form) else pack(form)
        is_flat = all(type(each) in SCALARS for each in self._built or ())
        return [Check(self.path, crc32(self._packed))] if self._packed and is_flat else []

    def read(self, writer: Writer) -> Forms:
        """What it holds."""
        built = self._built
        if built is not None:
            now = _items(self.thing)
            if now is not None and len(now) == len(built) and all(map(is_, now, built)):
                return None
        try:
            form = writer.content(self.thing)
            return None if pack(form) == self._packed else form
        except UnknownValue as error:
            raise UnkeepableState(self.path, text_of(error)) from error

    def made(self, forms: Forms, reader: Reader) -> Any:  # noqa: ANN401 -- a container
        """A container that holds what this one is to hold."""
        if forms is None and self._built is not None:
            return _of_items(self.thing, self._built)
        made = reader.content(self._form if forms is None else forms)
        _check_fits(self.thing, made)
        return made

    def put(self, made: Any) -> None:  # noqa: ANN401 -- a container
        """Fill it in place."""
        _fill(self.thing, made)

    def present(self) -> Any:  # noqa: ANN401 -- a container
        """A copy."""
        items = _items(self.thing)
        if items is not None:
            return _of_items(self.thing, items)
        return Reader().content(Writer().content(self.thing))

    def fields(self, forms: Forms, number_of: NumberOf) -> Fields:  # noqa: ARG002 -- as of others
        """The whole content; a comparison goes into it."""
        yield self.path, self._form if forms is None else forms


def _is_generator(form: Plain) -> bool:
    return not _GENERATORS.isdisjoint(form)


_GENERATORS: Final = frozenset({"random", "generator"})


def _items(thing: Thing) -> list[Any] | None:
    """What it holds, by reference: the keys of a dictionary, then its values; None of others."""
    if isinstance(thing, dict):
        return [*thing, *thing.values()]
    return [*thing] if isinstance(thing, list | deque) else None


def _of_items(thing: Thing, items: list[Any]) -> Any:  # noqa: ANN401 -- a container
    if isinstance(thing, dict):
        half = len(items) // 2
        return dict(zip(items[:half], items[half:], strict=True))
    return items


def _check_fits(thing: Thing, made: Any) -> None:  # noqa: ANN401 -- whatever stands in a file
    """Raise UnknownValue for what cannot be the content of a container."""
    base = dict if isinstance(thing, dict) else type(thing)
    is_fit = type(made) is base
    if is_fit and isinstance(thing, deque):
        is_fit = thing.maxlen == made.maxlen
    if is_fit and isinstance(thing, array):
        is_fit = thing.typecode == made.typecode
    if is_fit and base.__name__ == "ndarray":
        is_fit = (thing.shape, thing.dtype) == (made.shape, made.dtype)
    if not is_fit:
        raise UnknownValue(f"{made!r:.80} cannot be what a {base.__name__} holds in its place")


def _fill(thing: Thing, made: Any) -> None:  # noqa: ANN401 -- a container
    if isinstance(thing, dict | set):
        thing.clear()
        thing.update(made)
    elif isinstance(thing, deque):
        thing.clear()
        thing.extend(made)
    elif isinstance(thing, list | bytearray | array):
        thing[:] = made
    elif isinstance(thing, random.Random):
        thing.setstate(made.getstate())
    elif type(thing).__name__ == "ndarray":
        thing[...] = made
    else:  # a generator of numpy
        thing.state = made.state
