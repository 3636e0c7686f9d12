"""Atomic classes that model files may name as `name@Class`, and the keys their sections may have.

Installed packages make them known: an entry point of the group `firmware_runtime.ma_classes` leads
to an `AtomicClass`, or to a class derived from `Atomic`, which has the entry point's name; or to a
mapping of such by their names. An entry point that is called as a board of its package has that
board's classes: the files in the board's own folder know them, no others.

Every class is known as `PACKAGE:Class` to every file.
"""

import inspect
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal, NamedTuple, TypeAlias, get_type_hints

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.ecdpp.file_text import format_number, format_time, parse_number, parse_time
from firmware_runtime.errors import ConfigError, SettingError, text_of
from firmware_runtime.system.packages import EntryPoint, of_every_package

Value: TypeAlias = int | float | str
Kind: TypeAlias = Literal["time", "number", "whole", "word"]

_EXPECTED: Mapping[Kind, str] = {
    "time": "HH:MM:SS:ms",
    "number": "a number",
    "whole": "a whole number",
    "word": "a word",
}
_KINDS: Mapping[object, Kind] = {float: "number", int: "whole", str: "word"}


class Parameter(NamedTuple):
    """A key of a section, the constructor's keyword that it sets, and how its value is written."""

    key: str
    keyword: str
    kind: Kind

    def value(self, text: str) -> Value:
        """Return what the text stands for. Raises ValueError with a sentence."""
        found: Value | None
        if self.kind == "word":
            found = text or None
        elif self.kind == "time":
            found = parse_time(text)
        else:
            found = parse_number(text)
        if isinstance(found, float) and self.kind == "whole":
            found = int(found) if found.is_integer() else None
        if found is None:
            raise ValueError(f"{self.key} {text!r}: expected {_EXPECTED[self.kind]}")
        return found

    def text(self, value: object) -> str:
        """The value as a file has it. Raises ValueError with a sentence."""
        if self.kind == "word" and isinstance(value, str) and value and value.split() == [value]:
            return value
        if self.kind == "time" and type(value) is int and value >= 0 and not value % MILLISECOND:
            return format_time(value)
        if self.kind in {"number", "whole"} and isinstance(value, int | float):
            return format_number(value)
        expected = "whole milliseconds" if self.kind == "time" else _EXPECTED[self.kind]
        raise ValueError(f"{self.keyword} is {value!r}, and {self.key} takes {expected}")


@dataclass(frozen=True, slots=True)
class AtomicClass:
    """A constructor, and which of its keyword arguments a model file may set by which key.

    A file is written from a model too: then each argument is read from the model's attribute of the
    keyword's name.
    """

    build: Callable[..., Atomic]
    """Called with the model's name and the arguments the file sets."""
    times: Mapping[str, str] = field(default_factory=dict)
    """Keys with a value `HH:MM:SS:ms`, which arrives in ns."""
    numbers: Mapping[str, str] = field(default_factory=dict)
    """Keys with a whole number or a decimal, which arrives as float."""
    wholes: Mapping[str, str] = field(default_factory=dict)
    """Keys with a whole number, which arrives as int."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Keys with any text, which arrives as str."""

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every key and what it sets."""
        kinds: tuple[tuple[Mapping[str, str], Kind], ...] = (
            (self.times, "time"),
            (self.numbers, "number"),
            (self.wholes, "whole"),
            (self.words, "word"),
        )
        return {
            key: Parameter(key, keyword, kind)
            for keywords, kind in kinds
            for key, keyword in keywords.items()
        }

    @classmethod
    def of(cls, atomic: type[Atomic]) -> "AtomicClass":
        """Return the class as its constructor is annotated: each float, int or str is a key.

        Raises SettingError for an argument without default that is none of these.
        """
        found: dict[Kind, dict[str, str]] = {"number": {}, "whole": {}, "word": {}}
        for keyword, kind in _keywords(atomic):
            found[kind][keyword] = keyword
        return cls(atomic, {}, found["number"], found["whole"], found["word"])


def _keywords(atomic: type[Atomic]) -> Iterator[tuple[str, Kind]]:
    """The constructor's arguments behind the name that a file can set."""
    try:
        hints = get_type_hints(atomic.__init__)
    except NameError as error:
        raise SettingError(
            error, where=atomic.__name__, expected="annotations that exist"
        ) from error
    _, *arguments = inspect.signature(atomic).parameters.values()
    for argument in arguments:
        kind = _KINDS.get(hints.get(argument.name))
        if argument.kind in {argument.VAR_POSITIONAL, argument.VAR_KEYWORD}:
            continue
        if kind is not None:
            yield argument.name, kind
        elif argument.default is argument.empty:
            fault = f"no file can give {argument.name!r}; expected a default, or float, int or str"
            raise SettingError(fault, where=atomic.__name__)


GROUP: Final = "firmware_runtime.ma_classes"
BOARDS: Final = "firmware_runtime.boards"
_NONE: Final[Mapping[str, AtomicClass]] = MappingProxyType({})


class KnownClasses(dict[str, AtomicClass]):
    """Classes by name. `missing` says of each package that breaks the contract how: it adds none.

    `clashes` has the whole names of those that several packages call alike. A model that names
    none of these has nothing to do with either.
    """

    def __init__(
        self,
        classes: Mapping[str, AtomicClass],
        missing: Sequence[str] = (),
        clashes: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ) -> None:
        super().__init__(classes)
        self.missing = tuple(missing)
        self.clashes = dict(clashes)


class _Registered(NamedTuple):
    """A class of a package; `folder` is that of its board, whose files alone know it by name."""

    package: str
    name: str
    atomic_class: AtomicClass
    folder: Path | None

    @property
    def whole_name(self) -> str:
        """Return what every file may call it."""
        return f"{self.package}:{self.name}"

    def is_known_to(self, file: Path | None) -> bool:
        """Return whether this file may call it by its name alone."""
        if self.folder is None:
            return True
        return file is not None and file.resolve().is_relative_to(self.folder)


def known_classes(own: Mapping[str, AtomicClass] = _NONE, file: Path | None = None) -> KnownClasses:
    """Every class that is installed, as a file may call it; `own` go before them."""
    registered, missing = _installed_classes()
    by_name: defaultdict[str, list[_Registered]] = defaultdict(list)
    for each in registered:
        if each.is_known_to(file):
            by_name[each.name.casefold()].append(each)
    classes = dict(own)
    clashes: dict[str, Sequence[str]] = {}
    for name, found in by_name.items():
        if len(found) > 1:
            clashes[name] = [each.whole_name for each in found]
        elif name not in {each.casefold() for each in own}:
            classes[found[0].name] = found[0].atomic_class
    classes |= {each.whole_name: each.atomic_class for each in registered}
    return KnownClasses(classes, missing, clashes)


@cache
def _installed_classes() -> tuple[Sequence[_Registered], Sequence[str]]:
    """All of them, and what is wrong with packages that add none."""
    found: list[_Registered] = []
    missing: list[str] = []
    boards = {(package, each.name) for package, each in of_every_package(BOARDS)}
    for package, entry_point in of_every_package(GROUP):
        is_of_board = (package, entry_point.name) in boards
        try:
            classes = list(_classes_of(entry_point, package))
        except ConfigError as error:
            missing.append(str(error))
            continue
        folder = _folder_of(entry_point) if is_of_board else None
        found += [_Registered(package, name, each, folder) for name, each in classes]
    return found, missing


def _folder_of(entry_point: EntryPoint) -> Path | None:
    file = getattr(sys.modules[entry_point.module], "__file__", None)
    return None if file is None else Path(file).resolve().parent


def _classes_of(entry_point: EntryPoint, whose: str) -> Iterator[tuple[str, AtomicClass]]:
    """The classes that an entry point leads to. Raises ConfigError for anything else."""
    where = f"ma_classes {entry_point.name} of the package {whose}"
    try:
        loaded = entry_point.load()
    except (Exception, SystemExit) as error:
        fault = f"{type(error).__name__}: {text_of(error)}"
        raise ConfigError.of_one(where, fault) from error
    if not isinstance(loaded, Mapping):
        loaded = {entry_point.name: loaded}
    for name, each in loaded.items():
        try:
            yield name, _atomic_class(each)
        except SettingError as error:
            raise ConfigError.of_one(where, str(error)) from error


def _atomic_class(found: object) -> AtomicClass:
    if isinstance(found, AtomicClass):
        return found
    if isinstance(found, type) and issubclass(found, Atomic):
        return AtomicClass.of(found)
    raise SettingError("expected an AtomicClass or a class derived from Atomic", where=f"{found!r}")
