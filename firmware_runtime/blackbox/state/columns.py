"""What the known objects hold, in four columns: attributes, slots, content, memory.

A column reads what its objects hold now, sets it, and says which field each part of it is. What is
read of attributes are the dictionaries themselves, not copies: the pickler reads them at once.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeAlias

from msgspec import Struct

from firmware_runtime.blackbox.state.attributes import reader_of
from firmware_runtime.blackbox.state.contents import Content, shown
from firmware_runtime.blackbox.state.known import KnownObjects
from firmware_runtime.blackbox.state.layouts import (
    Layout,
    Thing,
    by_name,
    layout_of,
    slots_getter,
    slots_or_names,
)
from firmware_runtime.blackbox.state.making import set_attributes, set_slots
from firmware_runtime.blackbox.state.views import Views

Fields: TypeAlias = Iterator[tuple[str, Thing]]
"""Paths and values."""


class Column(Protocol):
    """One part of the state of the objects that have it, in order of their numbers."""

    def read(self) -> list[Thing]:
        """What they hold now."""

    def fill(self, made: list[Thing]) -> None:
        """Let them hold that. Raises where it does not fit."""

    def fields(self, read: list[Thing]) -> Fields:
        """What has been read, as fields."""


class Attributes:
    """Attributes, of objects that have a dictionary of them."""

    def __init__(
        self, objects: Iterable[tuple[str, Thing]], is_known: Callable[[object], bool]
    ) -> None:
        pairs = list(objects)
        self._paths = [path for path, _ in pairs]
        self._owners = [thing for _, thing in pairs]
        self._readers = [reader_of(each, is_known) for each in self._owners]
        self.names = list(dict.fromkeys(name for each in self.read() for name in sorted(each)))
        """Those there are at the start."""

    def read(self) -> list[Thing]:
        """Their dictionaries, or copies of them."""
        return [read() for read in self._readers]

    def fill(self, made: list[Thing]) -> None:
        """Set, change and delete attributes."""
        for thing, attributes in zip(self._owners, made, strict=True):
            if attributes is not vars(thing):  # or it was known itself, and has been set as such
                set_attributes(thing, attributes)

    def fields(self, read: list[Thing]) -> Fields:
        """Each attribute, those of an object in the order of their names."""
        for path, attributes in zip(self._paths, read, strict=True):
            if isinstance(attributes, dict):
                yield from ((f"{path}.{name}", attributes[name]) for name in sorted(attributes))


class Slots:
    """Slots, as tuples in the order of the layout; with one of them unset, by name."""

    def __init__(self, objects: Iterable[tuple[str, Thing, Layout]]) -> None:
        self._objects = [
            (path, thing, layout, slots_getter(layout)) for path, thing, layout in objects
        ]

    def read(self) -> list[Thing]:
        """What stands in them."""
        try:
            return [get(thing) for _, thing, _, get in self._objects]
        except AttributeError:
            return [slots_or_names(get, thing, layout) for _, thing, layout, get in self._objects]

    def fill(self, made: list[Thing]) -> None:
        """Set and delete them, by their descriptors: without a function of the class."""
        for (_, thing, layout, _), values in zip(self._objects, made, strict=True):
            set_slots(layout, thing, by_name(layout, values))

    def fields(self, read: list[Thing]) -> Fields:
        """Each slot."""
        for (path, _, layout, _), values in zip(self._objects, read, strict=True):
            named = by_name(layout, values).items()
            yield from ((f"{path}.{name}", value) for name, value in named)


class Contents:
    """What lists, dictionaries, cells and the like hold, and classes made of these."""

    def __init__(self, objects: Iterable[tuple[str, Thing, Content]]) -> None:
        self._objects = list(objects)

    def read(self) -> list[Thing]:
        """Copies of it."""
        return [content.read(thing) for _, thing, content in self._objects]

    def fill(self, made: list[Thing]) -> None:
        """Set it in place."""
        for (_, thing, content), each in zip(self._objects, made, strict=True):
            content.fill(thing, each)

    def fields(self, read: list[Thing]) -> Fields:
        """Each whole content; a comparison goes into it."""
        for (path, thing, _), each in zip(self._objects, read, strict=True):
            yield path, shown(thing, each)


class Columns(Struct, frozen=True):
    """The columns of a robot's objects."""

    attributes: Attributes
    slots: Slots
    contents: Contents
    views: Views

    @property
    def each(self) -> tuple[Column, ...]:
        """All four."""
        return self.attributes, self.slots, self.contents, self.views

    def copied(self) -> list[list[Thing]]:
        """What they hold now, and will be whatever becomes of the objects."""
        return [[*map(dict, self.attributes.read())], *(each.read() for each in self.each[1:])]

    def fill(self, made: list[list[Thing]]) -> None:
        """Let the objects hold that. Raises where it does not fit."""
        for column, each in zip(self.each, made, strict=True):
            column.fill(each)


def columns_of(known: KnownObjects) -> Columns:
    """The columns of the objects that have state. Raises UnkeepableState."""
    things = [(known.paths[number], known.things[number]) for number in known.with_state]
    found = [(path, thing, layout_of(type(thing))) for path, thing in things]
    contents = [(path, thing, layout.content) for path, thing, layout in found if layout.content]
    views = [(path, thing) for path, thing, layout in found if layout.base is memoryview]
    return Columns(
        Attributes(
            [(path, thing) for path, thing, layout in found if layout.has_attributes],
            lambda thing: known.number_of(thing) is not None,
        ),
        Slots([(path, thing, layout) for path, thing, layout in found if layout.slots]),
        Contents(contents),
        Views([(path, view) for path, view in views if not view.readonly]),
    )
