"""How `name@Class` in a model file becomes an atomic model, and which keys its section may have."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias, get_type_hints

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.ecdpp.text import format_number, format_time, parse_number, parse_time
from firmware_runtime.errors import SettingError

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
        """What the text stands for. Raises ValueError with a sentence."""
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
        """What the constructor's annotations say: `float`, `int` and `str` arguments are keys.

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
