"""Values in a recording: MessagePack from which the same value comes back, floats to the bit.

None, truth values, whole numbers of 64 bits, floats, texts and bytes are themselves; a tuple is an
array; everything else is a map of one key, which says what it is:

    {"list": [...]}                         its items
    {"dict": [[key, value], ...]}
    {"int": ["18446744073709551616"]}       one too large for 64 bits
    {"array": ["<f8", [3], bytes]}          of numpy; with "scalar" one of its numbers
    {"drivers.thrust_pairs:Forces": [...]}  fields of a named tuple, dataclass or Struct
    {"package.module:Colour": ["RED"]}      a member of an enumeration; of a Flag also its number

Nothing of a file is run: a class is looked up among the modules that the model has imported, must
be one that only holds fields, and is made without its own functions.
"""

import sys
from collections.abc import Callable, Sequence
from enum import Enum
from functools import cache
from operator import attrgetter
from types import ModuleType
from typing import Any, Final, TypeAlias

import msgspec

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.members import member_of, written_member
from firmware_runtime.recording.structs import struct_of

Plain: TypeAlias = Any
"""What MessagePack has words for."""

_encode: Final = msgspec.msgpack.Encoder().encode
_decode: Final = msgspec.msgpack.Decoder().decode
_SAME: Final = frozenset({type(None), bool, float, str, bytes})
_NUMPY: Final = frozenset({"array", "scalar"})
_EXPECTED: Final = (
    "expected a number, text, tuple, list, dict, enumeration, named tuple or dataclass"
)
_SMALL: Final = range(-(1 << 63), 1 << 63)


class UnknownValue(ValueError):
    """A value that cannot be recorded, or not be made of a recording."""


def plain(value: object) -> Plain:
    """A value in MessagePack's types. Raises UnknownValue."""
    kind = type(value)
    if kind in _SAME:
        return value
    if kind is int:
        return value if value in _SMALL else {"int": [str(value)]}
    try:
        if kind is tuple:
            return [plain(each) for each in value]  # type: ignore[attr-defined]
        return _tagged(kind)(value)  # type: ignore[arg-type]  # a class has a hash
    except UnknownValue:
        raise
    except Exception as error:  # too deep, or a function of the model's
        why = f"cannot be recorded ({type(error).__name__}: {text_of(error)}); {_EXPECTED}"
        raise UnknownValue(f"{kind.__module__}:{kind.__qualname__} {why}") from error


def encoded(value: object) -> bytes:
    """A value as bytes; the same bytes mean the same value, floats to the bit.

    Raises UnknownValue, also for a text that UTF-8 has not.
    """
    try:
        return _encode(plain(value))
    except UnknownValue:
        raise
    except Exception as error:
        fault = f"{_name_of(type(value))} cannot be recorded; {type(error).__name__}: {error}"
        raise UnknownValue(legible(fault)) from error


def legible(text: str) -> str:
    """A text that UTF-8 has: what came from outside may have lone surrogates."""
    return text.encode("utf-8", "backslashreplace").decode()


def made(of: Plain) -> Any:  # noqa: ANN401 -- whatever a port carries
    """The value that `plain` was made of. Raises UnknownValue."""
    if isinstance(of, list):
        return tuple(made(each) for each in of)
    if not isinstance(of, dict):
        return of
    try:
        ((name, parts),) = of.items()
        return _BUILTIN[name](parts) if name in _BUILTIN else _of_class(name, parts)
    except UnknownValue:
        raise
    except Exception as error:  # whatever stands in a file
        raise UnknownValue(f"{of!r:.80}: {type(error).__name__}: {error}") from error


def made_for(name: str, form: Plain) -> Any:  # noqa: ANN401 -- whatever a port carries
    """As `made`, of what a recording has by this name. Raises ConfigError."""
    try:
        return made(form)
    except UnknownValue as error:
        raise ConfigError.of_one("recording", f"{name}: {error}") from error


def numbers_in(form: Plain) -> Any:  # noqa: ANN401 -- whatever a port carries
    """The same with numbers and lists of them for what numpy had."""
    if isinstance(form, list):
        return [numbers_in(each) for each in form]
    if not isinstance(form, dict):
        return form
    if len(form) == 1 and _NUMPY.issuperset(form):
        try:
            return made(form).tolist()
        except (UnknownValue, AttributeError):
            return form
    return {key: numbers_in(each) for key, each in form.items()}


def pack(structure: Plain) -> bytes:
    """Plain values as bytes."""
    return _encode(structure)


def unpack(content: bytes) -> Plain:
    """Plain values of bytes. Raises msgspec.DecodeError."""
    return _decode(content)


@cache
def _tagged(kind: type[object]) -> Callable[[Any], Plain]:
    """How values of a class are written. Raises UnknownValue."""
    if issubclass(kind, Enum):
        name = _name_of(kind)
        return lambda value: {name: [written_member(value)]}
    if kind is list:
        return lambda value: {"list": [*map(plain, value)]}
    if kind is dict:
        return lambda value: {"dict": [[plain(k), plain(v)] for k, v in value.items()]}
    if kind.__module__.partition(".")[0] == "numpy" and hasattr(kind, "tobytes"):
        return _of_numpy
    return _record(kind)


def _record(kind: type[object]) -> Callable[[Any], Plain]:
    names, name = _field_names(kind), _name_of(kind)
    if len(names) < 2:
        return lambda value: {name: [plain(getattr(value, each)) for each in names]}
    get = attrgetter(*names)
    return lambda value: {name: [*map(plain, get(value))]}


def _field_names(kind: Any) -> Sequence[str]:  # noqa: ANN401 -- any class
    """The fields of a class that holds them and nothing else. Raises UnknownValue."""
    if issubclass(kind, tuple) and hasattr(kind, "_fields"):
        names: tuple[str, ...] = kind._fields
        return names
    if issubclass(kind, msgspec.Struct):
        struct: tuple[str, ...] = kind.__struct_fields__
        return struct
    from dataclasses import fields, is_dataclass  # noqa: PLC0415 -- not every robot has some

    if is_dataclass(kind):
        return tuple(field.name for field in fields(kind))
    raise UnknownValue(f"{_name_of(kind)} cannot be recorded; {_EXPECTED}")


def _name_of(kind: type[object]) -> str:
    return f"{kind.__module__}:{kind.__qualname__}"


def _of_numpy(value: Any) -> Plain:  # noqa: ANN401 -- numpy takes long to import
    if value.dtype.hasobject:
        raise UnknownValue("an array of objects cannot be recorded; expected one of numbers")
    shape = list(value.shape) if hasattr(value, "flags") and value.shape else []
    word = "array" if type(value).__name__ == "ndarray" else "scalar"
    return {word: [value.dtype.str, shape, value.tobytes()]}


def _array(parts: list[Any]) -> Any:  # noqa: ANN401 -- numpy takes long to import
    numpy: Any = sys.modules.get("numpy")
    if numpy is None:
        raise UnknownValue("an array of numpy; expected a model that imports it")
    kind, shape, content = parts
    return numpy.frombuffer(content, numpy.dtype(kind)).reshape(shape).copy()


_BUILTIN: Final[dict[str, Callable[[list[Any]], object]]] = {
    "int": lambda parts: int(parts[0]),
    "list": lambda parts: [made(each) for each in parts],
    "dict": lambda parts: {made(key): made(value) for key, value in parts},
    "array": _array,
    "scalar": lambda parts: _array(parts)[()],
}


def _of_class(name: str, parts: list[Any]) -> object:
    kind = _class_named(name)
    if issubclass(kind, Enum):
        (said,) = parts
        return member_of(kind, said)
    names, values = _field_names(kind), [made(each) for each in parts]
    if len(names) != len(values):
        raise UnknownValue(f"{name}: {len(values)} fields; expected {', '.join(names)}")
    if issubclass(kind, tuple):
        return tuple.__new__(kind, values)
    if issubclass(kind, msgspec.Struct):
        return struct_of(kind, dict(zip(names, values, strict=True)))
    record = object.__new__(kind)
    for field, value in zip(names, values, strict=True):
        object.__setattr__(record, field, value)
    return record


@cache
def _class_named(name: str) -> type[Any]:
    """A class of a module that is there already. Raises UnknownValue."""
    module, _, path = name.partition(":")
    found: Any = sys.modules.get(module)
    for word in path.split("."):
        # not through a module into another: `module:os.path` names nothing
        is_module = isinstance(found, ModuleType)
        found = vars(found).get(word) if is_module or isinstance(found, type) else None
    if not isinstance(found, type):
        raise UnknownValue(f"{name}: the model has no such class")
    return found
