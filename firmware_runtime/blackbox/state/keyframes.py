"""The whole state of a running robot between two steps, as bytes; and set back, in place.

How it works. When the table is made, everything that can be reached from the roots is numbered
(`known`). A capture is the fingerprint of this table, then one pickle of what each of these objects
holds (`columns`). In it they stand by their numbers: the pickler's memo holds them from the start,
so it takes them for written already (`pickled`). What was made since then is written by value
(`later`).

To set it back, everything is read, checked and made before the first object is changed. Then each
known object gets its attributes, slots and content in place, so that closures and bound methods
such as `bag.append` still lead to the same objects.
"""

import zlib
from collections.abc import Iterable, Iterator, Mapping
from struct import Struct
from threading import Lock, RLock
from typing import Any, Final, Protocol

from firmware_runtime.blackbox.state.carried import carried
from firmware_runtime.blackbox.state.columns import Column, columns_of
from firmware_runtime.blackbox.state.known import KnownObjects, edges_of
from firmware_runtime.blackbox.state.later import NoValue
from firmware_runtime.blackbox.state.layouts import Thing, UnkeepableState
from firmware_runtime.blackbox.state.making import Making, deep_calls
from firmware_runtime.blackbox.state.pickled import StateReader, StateWriter
from firmware_runtime.blackbox.state.state_differences import (
    ABSENT,
    FieldDifference,
    StateComparison,
)
from firmware_runtime.errors import ConfigError, text_of

__all__ = ["ABSENT", "FieldDifference", "ForeignState", "StateTable", "UnkeepableState"]

_FINGERPRINT: Final = Struct("<I")
LOCKS = (type(Lock()), type(RLock()))
"""Edges of every table: between two steps they are free."""


class ForeignState(ConfigError):
    """A file's state that is none of this robot, or is damaged, or cannot be set back."""

    @property
    def is_of_another_robot(self) -> bool:
        """Whether it is the state of other models."""
        return _OTHER_ROBOT in self.faults


class Aside(Protocol):
    """State that no root leads to, such as a generator of the process."""

    def read(self) -> Any:  # noqa: ANN401 -- plain values
        """What it is now; None for what it is without a word."""

    def put(self, found: Any) -> None:  # noqa: ANN401 -- as above
        """Let it be so again."""


class StateTable:
    """Captures and restores all that can be reached from `roots`, by name in their paths.

    Make it where every process that builds the same robot has it in the same state, such as before
    the first step. Objects, and objects of classes, in `edges` are kept as they are: lines, clocks,
    sockets, functions that print. Raises UnkeepableState for anything else whose state Python
    cannot read and set. Attributes of classes and names of modules are not part of it. What is
    `aside` is kept and set too, and not compared.
    """

    def __init__(
        self,
        roots: Mapping[str, object],
        edges: Iterable[object] = (),
        aside: Aside | None = None,
    ) -> None:
        self._aside = aside
        try:
            self._known = KnownObjects(roots, edges_of((*LOCKS, *edges)))
            self._columns = columns_of(self._known)
        except (UnkeepableState, MemoryError):
            raise
        except Exception as error:  # of a function of the model's, such as __repr__
            raise _unread(error) from error
        self._stateful = [self._known.things[number] for number in self._known.with_state]
        self._kinds = [*map(type, self._stateful)]
        names = self._columns.attributes.names
        self.objects = len(self._known.things)
        """How many objects have a number."""
        self.fingerprint = zlib.crc32("\n".join(names).encode(), self._known.fingerprint)
        """The same for robots that can exchange states."""
        self._writer = StateWriter(self._known.things, names, self._columns.views.part)
        self._reader = StateReader(self.objects, names)

    def capture(self) -> bytes:
        """The state now. Raises UnkeepableState for an object that was made since and has none.

        Raises MemoryError where there is no room for it, as every other function here does.
        """
        if [*map(type, self._stateful)] != self._kinds:
            raise self._of_another_class()
        aside = None if self._aside is None else self._aside.read()
        held = [] if aside is None else [aside]
        try:
            written = self._writer.written([*(each.read() for each in self._columns.each), *held])
        except NoValue as error:
            raise self._blamed(error) from error
        except MemoryError:  # says nothing of the state
            raise
        except Exception as error:  # as above
            raise _unread(error) from error
        return _FINGERPRINT.pack(self.fingerprint) + written

    def largest(self) -> str:
        """The path of the field that takes most of a capture."""
        each = (pair for column in self._columns.each for pair in column.fields(column.read()))
        sizes = {path: len(self._writer.written(value)) for path, value in each}
        return max(sizes, key=lambda path: sizes[path], default="")

    def restore(self, content: bytes, *, built: bytes | None = None) -> None:
        """Let the robot be in that state. Raises ForeignState; nothing has changed then.

        What is an edge stays as it is. Objects made since the robot was built are made again. With
        `built`, the state in which the recorded robot was built, what that had not changed since
        then stays as it is here: see `carried`.
        """
        aside, read = self._read(content)
        if built is not None:
            read = self._carried(read, self._read(built)[1])
        try:
            with deep_calls():
                made = Making(self._known.things, self._known.modules).of(read)
        except (NoValue, IndexError) as error:
            raise _foreign(f"{error}") from error
        for thing, kind in zip(self._stateful, self._kinds, strict=True):
            if type(thing) is not kind:
                thing.__class__ = kind
        before = self._columns.copied()
        try:
            self._columns.fill(made)
        except Exception as error:  # whatever stands in a file
            self._columns.fill(before)
            if isinstance(error, MemoryError):
                raise
            raise _foreign(f"{type(error).__name__}: {error}") from error
        del before
        self._columns.fill(made)  # again: what has gone with `before` may have changed others
        if self._aside is not None:
            self._aside.put(aside)

    def differences(self, content: bytes) -> Iterator[FieldDifference]:
        """Each field that is another now than it was recorded. Raises as `capture` and `restore`.

        Floats are the same if they are so to the bit, known objects if they are the same objects.
        """
        (_, recorded), (_, present) = self._read(content), self._read(self.capture())
        comparison = StateComparison(self._known)
        for column, old, new in zip(self._columns.each, recorded, present, strict=True):
            before, after = _fields(column, old), _fields(column, new)
            for path in [*before, *(path for path in after if path not in before)]:
                pair = before.get(path, ABSENT), after.get(path, ABSENT)
                yield from comparison.between(path, *pair)

    def _carried(self, recorded: list[list[Thing]], built: list[list[Thing]]) -> list[list[Thing]]:
        """The columns of a robot that was built otherwise, in the recorded state."""
        comparison = StateComparison(self._known)

        def same(one: Thing, other: Thing) -> bool:
            return next(comparison.between("", one, other), None) is None

        _, present = self._read(self.capture())
        merged: list[list[Thing]] = carried(recorded, built, present, same)
        return merged

    def _read(self, content: bytes) -> tuple[Any, list[list[Thing]]]:
        """What is aside, and the columns of a file."""
        columns: list[list[Thing]]
        if content[: _FINGERPRINT.size] != _FINGERPRINT.pack(self.fingerprint):
            raise _foreign(_OTHER_ROBOT)  # where an object would take the place of another
        try:
            columns = [*self._reader.read(content[_FINGERPRINT.size :])]
        except (NoValue, TypeError) as error:
            raise _foreign(f"{error}") from error
        aside = columns.pop() if len(columns) == len(self._columns.each) + 1 else None
        if len(columns) != len(self._columns.each):
            raise _foreign(f"{len(columns)} columns; expected {len(self._columns.each)}")
        return aside, columns

    def _of_another_class(self) -> UnkeepableState:
        each = zip(self._known.with_state, self._stateful, self._kinds, strict=True)
        number, thing, kind = next(found for found in each if type(found[1]) is not found[2])
        path = self._known.paths[number]
        became = f"a {kind.__qualname__} that has become a {type(thing).__qualname__}"
        return UnkeepableState(path, f"{became}; expected an object of one class")

    def _blamed(self, error: NoValue) -> UnkeepableState:
        """The error, with the path of the field that cannot be written."""
        for column in self._columns.each:
            for path, value in column.fields(column.read()):
                try:
                    self._writer.written(value)
                except NoValue as found:
                    return UnkeepableState(path, f"{found}; {EXPECTED}")
        return UnkeepableState("state", f"{error}; {EXPECTED}")


EXPECTED = "expected numbers, texts, containers, arrays and objects made of these"


def _unread(error: Exception) -> UnkeepableState:
    return UnkeepableState("state", f"{type(error).__name__}: {text_of(error)}; {EXPECTED}")


def _fields(column: Column, read: list[Thing]) -> dict[str, Thing]:
    try:
        return dict(column.fields(read))
    except (TypeError, ValueError, AttributeError) as error:
        raise _foreign(f"{type(error).__name__}: {error}") from error


_OTHER_ROBOT: Final = "it is of another robot; expected one of this board and these settings"


def _foreign(fault: str) -> ForeignState:
    return ForeignState("state", [fault], f"state: {fault}")
