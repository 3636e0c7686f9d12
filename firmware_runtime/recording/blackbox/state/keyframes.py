"""The whole state of a running robot between two steps, as bytes; and set back, in place.

How it works. When the table is made, the robot as it was built is walked (`walk`): each object that
has state gets a row and a number. A capture is the fingerprint of this table, checks of what was
built with a number or text, and what of each row is not as built (`rows`), as plain values in the
one encoding that recordings have (`recording.values`). A known object stands in it by its number.

To set it back, everything is read, checked and made before the first object is changed: then each
object gets its attributes or content in place. What the state does not name is as this robot was
built; so a robot of other settings takes up what the run had changed, and keeps its own settings.
"""

import zlib
from collections.abc import Iterable, Iterator, Mapping
from struct import Struct
from typing import Any, Final, Protocol

import msgspec

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.collection import no_collection
from firmware_runtime.errors import text_of
from firmware_runtime.recording.blackbox.state.content import Content
from firmware_runtime.recording.blackbox.state.differences import ABSENT, FieldDifference, between
from firmware_runtime.recording.blackbox.state.rows import ABSENT as ABSENT_FORM
from firmware_runtime.recording.blackbox.state.rows import Attributes, Declared, Forms, Row
from firmware_runtime.recording.blackbox.state.walk import (
    OTHER_ROBOT,
    ForeignState,
    Found,
    UnkeepableState,
    declares_state,
    found_in,
)
from firmware_runtime.recording.recorded_board import packages_used
from firmware_runtime.recording.records import UnknownValue
from firmware_runtime.recording.values import Reader, Writer, pack, unpack

__all__ = ["ABSENT", "FieldDifference", "ForeignState", "StateTable", "UnkeepableState"]


_CHECK: Final = Struct("<H")


class Aside(Protocol):
    """State that no root leads to, such as a generator of the process."""

    def read(self) -> object:
        """What it is now; None for what it is without a word."""

    def put(self, found: Any) -> None:  # noqa: ANN401 -- as above
        """Let it be so again."""


class StateTable:
    """Captures and restores all that can be reached from `roots`, by name in their paths.

    Make it where every process that builds the same robot has it in the same state, such as before
    the first step. Objects, and objects of classes, in `edges` are kept as they are: lines, clocks,
    sockets, functions that print. Raises UnkeepableState for anything else whose state is no plain
    value. Attributes of classes and names of modules are not part of it. What is `aside` is kept
    and set too, and not compared.
    """

    def __init__(
        self,
        roots: Mapping[str, object],
        edges: Iterable[object] = (),
        aside: Aside | None = None,
    ) -> None:
        self._aside = aside
        try:
            self._rows = [row for each in found_in(roots, edges) for row in _rows_of(each)]
        except (UnkeepableState, MemoryError):
            raise
        except Exception as error:  # of a function of the model's, such as a property
            raise UnkeepableState("state", f"{type(error).__name__}: {text_of(error)}") from error
        self._numbers = {id(row.thing): n for n, row in reversed([*enumerate(self._rows)])}
        self._checks = [
            (number, each.path, _CHECK.pack(each.check & 0xFFFF))
            for number, row in enumerate(self._rows)
            for each in row.keep_built(self._number_of)
        ]
        self._built = b"".join(check for *_, check in self._checks)
        self._packages = packages_used({row.kind.__module__ for row in self._rows})
        signature = "\n".join(row.signature for row in self._rows)
        self.objects = len(self._rows)
        """How many objects have state."""
        self.fingerprint = zlib.crc32(signature.encode())
        """The same for robots that can exchange states."""

    def capture(self) -> bytes:
        """The state now. Raises UnkeepableState for a part of it that is no plain value.

        Raises MemoryError where there is no room for it, as every other function here does.
        """
        with no_collection():  # of all that is made here nothing is left
            return self._captured()

    def largest(self) -> str:
        """The path of the field that takes most of a capture."""
        _, forms, _ = self._read(self.capture())
        sizes = {
            path: len(pack(form))
            for number, row in enumerate(self._rows)
            if number in forms
            for path, form in row.fields(forms[number], self._number_of)
        }
        return max(sizes, key=lambda path: sizes[path], default="")

    def restore(self, content: bytes) -> None:
        """Let the robot be in that state. Raises ForeignState; nothing has changed then.

        What is an edge stays as it is, and what the state does not name is as this robot was built.
        """
        _, forms, aside = self._read(content)
        reader = Reader(self._known, self._packages)
        try:
            made = [row.made(forms.get(n), reader) for n, row in enumerate(self._rows)]
        except (UnknownValue, TypeError, ValueError, AttributeError) as error:
            raise ForeignState(text_of(error)) from error
        before = [row.present() for row in self._rows]
        try:
            self._put(made)
        except Exception as error:  # of a model's restore, whatever stands in a file
            self._put(before)
            if isinstance(error, MemoryError):
                raise
            raise ForeignState(f"{type(error).__name__}: {text_of(error)}") from error
        if self._aside is not None:
            self._aside.put(aside)

    def differences(self, content: bytes) -> Iterator[FieldDifference]:
        """Each field that is another now than it was recorded. Raises as `capture` and `restore`.

        Floats are the same if they are so to the bit, known objects if they are the same objects.
        Of what was built otherwise than in the run only the object is known.
        """
        built, recorded, _ = self._read(content)
        _, present, _ = self._read(self.capture())
        yield from self._built_otherwise(built, recorded, present)
        for number, row in enumerate(self._rows):
            pair = recorded.get(number), present.get(number)
            if pack(pair[0]) != pack(pair[1]):
                try:
                    yield from [*self._between(row, *pair)]
                except (UnknownValue, TypeError, ValueError, RecursionError) as error:
                    raise ForeignState(text_of(error)) from error

    # ---------------------------------------------------------------------------------------------

    def _captured(self) -> bytes:
        writer = Writer(self._number_of)
        forms: dict[int, Forms] = {}
        for number, row in enumerate(self._rows):
            if type(row.thing) is not row.kind:
                became = f"has become a {type(row.thing).__qualname__}"
                raise UnkeepableState(row.path, f"a {row.kind.__qualname__} that {became}")
            try:
                found = row.read(writer)
            except (UnkeepableState, MemoryError):
                raise
            except Exception as error:  # a function of the model's
                raise UnkeepableState(row.path, f"{type(error).__name__}: {error}") from error
            if found is not None:
                forms[number] = found
        aside = None if self._aside is None else self._aside.read()
        try:
            return pack([self.fingerprint, self._built, forms, aside])
        except UnknownValue as error:
            raise self._blamed(forms, error) from error

    def _built_otherwise(
        self, built: bytes, recorded: Mapping[int, Forms], present: Mapping[int, Forms]
    ) -> Iterator[FieldDifference]:
        """What was built with another number or text than in the run, and not changed since."""
        if built == self._built:
            return
        for place, (number, path, check) in enumerate(self._checks):
            begin = place * _CHECK.size
            is_told = self._rows[number].is_told
            if built[begin : begin + _CHECK.size] != check and not (
                is_told(path, recorded.get(number)) and is_told(path, present.get(number))
            ):
                yield FieldDifference(path, "built otherwise", "as it is built here")

    def _between(self, row: Row, recorded: Forms, present: Forms) -> Iterator[FieldDifference]:
        before, after = (dict(row.fields(each, self._number_of)) for each in (recorded, present))
        for path in [*before, *(each for each in after if each not in before)]:
            forms = before.get(path, ABSENT_FORM), after.get(path, ABSENT_FORM)
            yield from between(path, *forms)

    def _put(self, made: list[object]) -> None:
        """Let each object hold what was made: what a model does in `restore` comes first."""
        pairs = [*zip(self._rows, made, strict=True)]
        for row, each in sorted(pairs, key=lambda pair: not isinstance(pair[0], Declared)):
            row.put(each)

    def _number_of(self, thing: object) -> int | None:
        return self._numbers.get(id(thing))

    def _known(self, number: object) -> object:
        if type(number) is not int or not 0 <= number < len(self._rows):
            raise UnknownValue(f"{number!r:.40}; expected the number of an object")
        return self._rows[number].thing

    def _read(self, content: bytes) -> tuple[bytes, dict[int, Forms], object]:
        """Checks of what was built, the forms of a file by number, and what is aside."""
        try:
            fingerprint, built, forms, aside = unpack(content)
            numbers = set(forms)
        except (msgspec.MsgspecError, TypeError, ValueError) as error:
            raise ForeignState(f"{type(error).__name__}: {error}") from error
        if fingerprint != self.fingerprint:
            raise ForeignState(OTHER_ROBOT)  # where an object would take the place of another
        if not isinstance(forms, dict) or not numbers <= set(range(len(self._rows))):
            raise ForeignState("it names objects that are not there")
        if not isinstance(built, bytes):
            raise ForeignState("it does not say what the robot was built with")
        return built, forms, aside

    def _blamed(self, forms: Mapping[int, Forms], error: Exception) -> UnkeepableState:
        """The error, with the path of the field that cannot be written."""
        for number, each in forms.items():
            for path, form in self._rows[number].fields(each, self._number_of):
                try:
                    pack(form)
                except UnknownValue as why:
                    return UnkeepableState(path, text_of(why))
        return UnkeepableState("state", text_of(error))


def _rows_of(found: Found) -> list[Row]:
    """The rows of an object: of a model that declares its state, phase and sigma too."""
    path, thing, is_container = found
    if is_container:
        return [Content(path, thing)]
    if not declares_state(thing):
        return [Attributes(path, thing)]
    declared: list[Row] = [Declared(path, thing)]
    if isinstance(thing, Atomic):
        declared.insert(0, Attributes(path, thing, ("phase", "sigma")))
    return declared
