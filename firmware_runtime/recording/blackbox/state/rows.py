"""Rows: one for each object of a robot that has state; what it holds beside what it was built with.

A row reads what its object holds and is not as built, in plain forms; makes values of such forms,
checking all of them; and sets them. What the forms do not name is as built.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from operator import attrgetter, is_
from types import BuiltinFunctionType, CellType, MethodType
from typing import Any, Final, NamedTuple, TypeAlias
from zlib import crc32

from firmware_runtime.errors import text_of
from firmware_runtime.recording.blackbox.state.attributes import reader_of
from firmware_runtime.recording.blackbox.state.walk import (
    Thing,
    UnkeepableState,
    has_attributes,
)
from firmware_runtime.recording.records import UnknownValue, in_class, name_of, slots_of
from firmware_runtime.recording.values import Plain, Reader, Writer, pack

Forms: TypeAlias = Any
"""What a row has written of its object."""
NumberOf: TypeAlias = Callable[[object], int | None]
Fields: TypeAlias = Iterator[tuple[str, Plain]]
"""Paths and forms."""


class Check(NamedTuple):
    """That what was built with the same number or text has the same check."""

    path: str
    check: int


ABSENT: Final[Plain] = {"absent": []}
"""The form of an attribute that was there at the start and is no more."""
AS_BUILT: Final[Plain] = {"as built": []}
"""What is said of a part that has no form, such as a function."""
_TO_THE_BIT: Final = frozenset({bool, int, str, bytes})
_NOTHING: Final = object()
SCALARS: Final = frozenset({type(None), bool, int, float, str, bytes})


class Row(ABC):
    """What became of one object since the robot was built."""

    def __init__(self, path: str, thing: Thing) -> None:
        self.path = path
        self.thing = thing
        self.kind = type(thing)

    @property
    def signature(self) -> str:
        """The same for what can exchange states."""
        return f"{self.path} {name_of(self.kind)}"

    def keep_built(self, number_of: NumberOf) -> list[Check]:  # noqa: ARG002 -- as of others
        """Keep what it was built with; return checks of what of it is a number or text."""
        return []

    def is_told(self, path: str, forms: Forms) -> bool:
        """Whether these forms say what stands at a path, whatever it was built with."""
        return forms is not None and path == self.path

    @abstractmethod
    def read(self, writer: Writer) -> Forms:
        """What is not as built; None if all is. Raises UnkeepableState."""

    @abstractmethod
    def made(self, forms: Forms, reader: Reader) -> Any:  # noqa: ANN401 -- for `put`
        """What to put, of forms or None. Raises UnknownValue, ValueError, TypeError."""

    @abstractmethod
    def put(self, made: Any) -> None:  # noqa: ANN401 -- of `made`, or `present`
        """Let the object hold that."""

    @abstractmethod
    def present(self) -> Any:  # noqa: ANN401 -- for `put`
        """What it holds, so that it can be put back."""

    @abstractmethod
    def fields(self, forms: Forms, number_of: NumberOf) -> Fields:
        """Forms by the paths of what they are; of what is as built too."""


class Attributes(Row):
    """Of a holder: its attributes, or slots; of a closure's variable what it is bound to."""

    def __init__(self, path: str, thing: Thing, only: tuple[str, ...] = ()) -> None:
        super().__init__(path, thing)
        self._slots = slots_of(self.kind)
        self._read = _reader(thing, self._slots, only)
        self._only = only
        self._built = dict(self._read())
        self._packed: dict[str, bytes | None] = {}

    @property
    def signature(self) -> str:
        """Its attributes by name as well."""
        return f"{super().signature} {' '.join(sorted(self._built))}"

    def keep_built(self, number_of: NumberOf) -> list[Check]:
        """Keep the attributes that it was built with, as bytes."""
        for name, value in self._built.items():
            try:
                self._packed[name] = pack(Writer(number_of).plain(value))
            except UnknownValue:
                self._packed[name] = None
        return [
            Check(f"{self.path}.{name}", crc32(self._packed[name] or b""))
            for name in sorted(self._built)
            if type(self._built[name]) in SCALARS
        ]

    def is_told(self, path: str, forms: Forms) -> bool:
        """Whether the forms have that attribute."""
        return path.removeprefix(f"{self.path}.") in _mapping(forms)

    def read(self, writer: Writer) -> Forms:
        """Attributes that are others by name."""
        built, forms = self._built, {}
        now = self._read()
        if len(now) == len(built) and all(map(is_, now.values(), built.values())):
            return None
        for name, value in now.items():
            was = built.get(name, _NOTHING)
            if value is was:
                continue
            kind = type(value)
            if kind is type(was) and kind in _TO_THE_BIT and value == was:
                continue
            if kind is float:
                forms[name] = value
            elif not _is_same_function(value, was):
                form, packed = self._form(name, value, writer)
                if packed != self._packed.get(name):
                    forms[name] = form
        if len(now) < len(built) or now.keys() != built.keys():
            forms.update((name, ABSENT) for name in built if name not in now)
        return forms or None

    def made(self, forms: Forms, reader: Reader) -> dict[str, Any]:
        """Attributes by name."""
        made = dict(self._built)
        for name, form in _mapping(forms).items():
            if form == ABSENT:
                made.pop(name, None)
                continue
            if name not in self._built and not self._may_come(name):
                raise UnknownValue(f"{self.path} has no attribute {name!r:.40}")
            made[name] = reader.made(form)
        return made

    def put(self, made: Any) -> None:  # noqa: ANN401 -- attributes by name
        """Set, change and delete attributes."""
        thing, slots = self.thing, self._slots
        present = self.present()
        for name, value in made.items():
            if value is present.get(name, _NOTHING):
                continue
            if name in slots:
                slots[name].__set__(thing, value)
            else:
                object.__setattr__(thing, name, value)
        for name in present.keys() - made.keys():
            object.__delattr__(thing, name)

    def present(self) -> dict[str, Any]:
        """Attributes by name."""
        return dict(self._read())

    def fields(self, forms: Forms, number_of: NumberOf) -> Fields:
        """Each attribute."""
        forms = _mapping(forms)
        for name in sorted(self._built.keys() | forms.keys()):
            form = forms.get(name, AS_BUILT)
            if form == AS_BUILT and name in self._built:
                form = _form_or_as_built(self._built[name], Writer(number_of))
            yield f"{self.path}.{name}", form

    def _form(self, name: str, value: object, writer: Writer) -> tuple[Plain, bytes]:
        """A value as a form and as bytes. Raises UnkeepableState."""
        try:
            form = writer.plain(value)
            return form, pack(form)
        except UnknownValue as error:
            raise UnkeepableState(f"{self.path}.{name}", text_of(error)) from error

    def _may_come(self, name: Any) -> bool:  # noqa: ANN401 -- whatever stands in a file
        """Whether an attribute of that name can be set without a function of the class."""
        is_name = isinstance(name, str) and name.isidentifier() and not name.startswith("__")
        if not is_name or self._only or not has_attributes(self.thing):
            return isinstance(name, str) and name in self._slots and not self._only
        return not hasattr(type(in_class(self.kind, name)), "__set__")


class Declared(Row):
    """Of an object that says itself what its state is."""

    def read(self, writer: Writer) -> Forms:
        """What `state` returns. Raises UnkeepableState."""
        try:
            return writer.plain(self.thing.state())
        except UnknownValue as error:
            raise UnkeepableState(f"{self.path}.state()", text_of(error)) from error

    def made(self, forms: Forms, reader: Reader) -> Any:  # noqa: ANN401 -- what it declares
        """What `restore` gets."""
        return reader.made(forms)

    def put(self, made: Any) -> None:  # noqa: ANN401 -- as above
        """Have the object take it up."""
        self.thing.restore(made)

    def present(self) -> Any:  # noqa: ANN401 -- as above
        """What it says now."""
        return self.thing.state()

    def fields(self, forms: Forms, number_of: NumberOf) -> Fields:  # noqa: ARG002 -- as of others
        """By name where it is a dictionary of texts."""
        if isinstance(forms, dict) and forms.keys() == {"dict"}:
            pairs = forms["dict"]
            if all(isinstance(key, str) for key, _ in pairs):
                yield from ((f"{self.path}.{key}", form) for key, form in pairs)
                return
        yield self.path, forms


# What a holder's attributes are -------------------------------------------------------------------


def _reader(
    thing: Thing, slots: dict[str, Thing], only: tuple[str, ...]
) -> Callable[[], dict[str, Any]]:
    """Reads the attributes of an object by name, or those alone."""
    if only:
        get_only = attrgetter(*only)
        return lambda: dict(zip(only, get_only(thing), strict=True))
    if type(thing) is CellType:
        return lambda: _in_cell(thing)
    if not slots:
        return reader_of(thing)
    rest = reader_of(thing) if has_attributes(thing) else dict
    names, get = tuple(slots), attrgetter("__class__", "__class__", *slots)

    def read() -> dict[str, Any]:
        try:
            found = dict(zip(names, get(thing)[2:], strict=True))
        except AttributeError:  # one is not set
            found = {name: getattr(thing, name) for name in names if hasattr(thing, name)}
        return found | rest()

    return read


def _in_cell(cell: CellType) -> dict[str, Any]:
    try:
        return {"cell_contents": cell.cell_contents}
    except ValueError:  # not filled
        return {}


def _is_same_function(value: object, was: object) -> bool:
    """Whether a bound method is the one that was there, bound again."""
    return isinstance(value, MethodType | BuiltinFunctionType) and value == was


def _form_or_as_built(value: object, writer: Writer) -> Plain:
    try:
        return writer.plain(value)
    except UnknownValue:
        return AS_BUILT


def _mapping(forms: Forms) -> dict[str, Plain]:
    if forms is None:
        return {}
    if not isinstance(forms, dict):
        raise UnknownValue(f"{forms!r:.40}; expected attributes by name")
    return forms
