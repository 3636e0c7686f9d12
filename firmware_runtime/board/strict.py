"""Strict reading of settings: every fault of a whole file at once, each with its key.

The schema is a tree of `msgspec.Struct` classes. msgspec judges each value on its own; walking the
tree here, instead of converting it in one go, is what lets the user see all faults together.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, cast, get_args, get_origin

import msgspec
from msgspec.structs import FieldInfo

from firmware_runtime.board.variants import Table, Variants, is_struct, keys, variants_of
from firmware_runtime.errors import expected_one_of, suggested

S = TypeVar("S", bound=msgspec.Struct)


DEEPEST = 32
"""Levels of tables and lists within each other: far more than any board has, far fewer than
Python's own recursion bears."""
_LONGEST_SHOWN = 200
_TOML_WORDS = {"object": "a table", "array": "a list", "null": "nothing"}
"""What msgspec calls as JSON does."""
_TOO_DEEP = f"nested more than {DEEPEST} deep; expected the tables of a board"


def parse_toml(text: str, faults: list[str]) -> Table:
    """The file's table; a syntax error is one fault and leaves the table empty."""
    try:
        table = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, and what Python's own numbers do not take
        faults.append(f"not valid TOML: {error}")
    except RecursionError:
        faults.append(_TOO_DEEP)
    else:
        return bounded(table, faults)
    return {}


def bounded(table: Table, faults: list[str]) -> Table:
    """The table, unless it is nested too deeply: that is one fault and leaves it empty.

    Without recursion, so that whatever comes after may recurse.
    """
    level: list[object] = [table]
    for _ in range(DEEPEST):
        level = [inner for each in level for inner in _inside(each)]
        if not level:
            return table
    faults.append(_TOO_DEEP)
    return {}


def override(table: Table, assignments: Sequence[str], faults: list[str]) -> None:
    """Apply `KEY=VALUE` assignments; keys are dotted as in TOML, values TOML or else plain strings.

    A key in quotes may have dots of its own: `link.limits."controller.forces"=[-1, 1]`.
    """
    for assignment in assignments:
        key, separator, value = assignment.partition("=")
        if not (key.strip() and separator):
            faults.append(f"{_set(assignment)}: expected KEY=VALUE, such as controller.kp=0.8")
        elif not _is_text(assignment):
            faults.append(f"{_set(assignment)}: not valid UTF-8; expected KEY=VALUE as text")
        elif key.count(".") >= DEEPEST:
            faults.append(f"{_set(assignment)}: {_TOO_DEEP}")
        else:
            _assign(table, key.strip(), value.strip(), faults)


def _assign(table: Table, key: str, value: str, faults: list[str]) -> None:
    *parents, leaf = key_path(key)
    target: Any = table
    for parent in parents:
        target = target.setdefault(parent, {}) if isinstance(target, dict) else None
    if isinstance(target, dict):
        target[leaf] = _toml_value(key, value, faults)
    else:
        faults.append(f"{key}: unknown key; {'.'.join(parents)} is a value, not a table")


def key_path(key: str) -> list[str]:
    """The names of which a dotted key is made; one in quotes may have dots of its own."""
    try:
        found: object = tomllib.loads(f"{key} = 0")
    except (ValueError, RecursionError):
        return key.split(".")
    path: list[str] = []
    while isinstance(found, dict) and len(found) == 1:
        (name,) = found
        path.append(name)
        found = found[name]
    return path if found == 0 else key.split(".")


def _toml_value(key: str, text: str, faults: list[str]) -> object:
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except RecursionError:
        faults.append(f"{key}: {_TOO_DEEP}")
        return None
    except ValueError:
        return text
    found: list[str] = []
    bounded({key: value}, found)
    faults.extend(f"{key}: {fault}" for fault in found)
    return None if found else value


def _set(assignment: str) -> str:
    return f"--set {shown(assignment)}"


def _is_text(argument: str) -> bool:
    """Return whether the bytes of an argument were text; others come as surrogates."""
    return argument.isascii() or not any("\ud800" <= letter <= "\udfff" for letter in argument)


def _inside(value: object) -> Iterable[object]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def shown(value: object) -> str:
    """A value as a sentence shows it: not all of one that has no end."""
    try:
        text = repr(value)
    except ValueError:  # of an integer with more digits than Python prints
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


def convert(
    table: Mapping[str, object], schema: type[S], faults: list[str], path: str = ""
) -> S | None:
    """The settings as `schema`, or None with at least one more line in `faults`."""
    before = len(faults)
    faults += _unknown(table, keys(schema), path)
    values = _values(table, schema, faults, path, "")
    return schema(**values) if len(faults) == before else None


def _table(table: Mapping[str, object], type_: object, faults: list[str], path: str) -> Any:
    variants = variants_of(type_)
    if variants is None:
        return convert(table, cast("type[msgspec.Struct]", type_), faults, path)
    return _variant(table, variants, faults, path)


def _variant(table: Mapping[str, object], variants: Variants, faults: list[str], path: str) -> Any:
    """The settings as the variant that the table chooses, or None; see `variants`."""
    before, choice, tag = len(faults), variants.choice, variants.chosen(table)
    strange = {key: value for key, value in table.items() if key not in variants.names()}
    faults += _unknown(strange, variants.names(tag), path)
    if tag is None:
        faults.append(_no_choice(table, variants, path))
        _judge_common(table, variants, faults, path)
        return None
    for key, reason in variants.foreign_keys(table):
        faults.append(f"{_join(path, key)}: has no effect; {reason}")
    schema = variants.schemas[tag]
    values = _values(table, schema, faults, path, f"; {choice} {tag!r} needs it")
    return schema(**values) if len(faults) == before else None


def _no_choice(table: Mapping[str, object], variants: Variants, path: str) -> str:
    key, expected = _join(path, variants.choice), f"expected one of {', '.join(variants.schemas)}"
    if variants.choice not in table:
        return f"{key}: missing; {expected}"
    stated = shown(table[variants.choice])
    word = stated.strip("'")
    return f"{key}: {stated}: {suggested(word, variants.schemas, expected)}"


def _judge_common(
    table: Mapping[str, object], variants: Variants, faults: list[str], path: str
) -> None:
    """Find the faults of keys that every variant has: they are faults whatever the choice."""
    first, *others = variants.schemas.values()
    for field in _fields(first):
        key = field.encode_name
        if key in table and all(key in keys(each) for each in others):
            _value(table[key], field.type, faults, _join(path, key))


def _unknown(table: Mapping[str, object], known: Sequence[str], path: str) -> list[str]:
    return [
        f"{_join(path, key)}: unknown key; {expected_one_of(key, known)}"
        for key in table
        if key not in known
    ]


def _values(
    table: Mapping[str, object],
    schema: type[msgspec.Struct],
    faults: list[str],
    path: str,
    why: str,
) -> dict[str, Any]:
    """The values of the keys that a schema has; `why` is said of one that is missing."""
    values: dict[str, Any] = {}
    for field in _fields(schema):
        key, hint = field.encode_name, field.type
        if key in table:
            values[field.name] = _value(table[key], hint, faults, _join(path, key))
        elif field.required:
            faults.append(f"{_join(path, key)}: missing{why}; expected {_wanted(hint)}")
    return values


@cache
def _fields(schema: type[msgspec.Struct]) -> tuple[FieldInfo, ...]:
    """Return the keys of a table; a robot that runs reads its file again."""
    return msgspec.structs.fields(schema)


def _value(value: object, type_: object, faults: list[str], path: str) -> Any:
    type_ = _present(type_)
    if isinstance(value, dict) and _is_table(type_):
        return _table(value, type_, faults, path)
    if get_origin(type_) is dict and isinstance(value, dict):
        inner = get_args(type_)[1]
        return {key: _value(each, inner, faults, _join(path, key)) for key, each in value.items()}
    if get_origin(type_) is tuple and _is_table(get_args(type_)[0]) and isinstance(value, list):
        inner = get_args(type_)[0]
        return tuple(_value(each, inner, faults, f"{path}[{n}]") for n, each in enumerate(value))
    if not _is_finite(value):
        faults.append(f"{path}: {shown(value)} is not a finite number")
        return None
    try:
        return msgspec.convert(value, type_)
    except (msgspec.ValidationError, OverflowError) as error:
        faults.append(f"{path}: {shown(value)}: {_sentence(str(error), type_)}")
        return None


def _is_finite(value: object) -> bool:
    """Return whether all numbers in a value are finite; True of anything else."""
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def _present(type_: object) -> Any:
    """Return the type of a table that is there, if it may be left out; any other as it is."""
    parts = get_args(type_)
    if get_origin(type_) is Annotated and is_struct(parts[0]):
        return parts[0]
    kinds = [each for each in parts if each is not NoneType]
    optional = get_origin(type_) is UnionType and len(kinds) == 1 and is_struct(kinds[0])
    return kinds[0] if optional else type_


def _is_table(type_: object) -> bool:
    return is_struct(type_) or variants_of(type_) is not None


def _wanted(type_: object) -> str:
    if _is_table(type_) or get_origin(type_) is dict:
        return "a table"
    base: Any = get_args(type_)[0] if get_origin(type_) is Annotated else type_
    if get_origin(base) in {tuple, list}:
        return "a list"
    if choices := _choices(type_):
        return f"one of {', '.join(map(str, choices))}"
    return {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}.get(
        base, "a value"
    )


def _sentence(text: str, type_: object) -> str:
    """Return what msgspec says, in the words of TOML."""
    if text.startswith("Invalid enum value") and (choices := _choices(type_)):
        return f"expected one of {', '.join(map(str, choices))}"
    for of_json, of_toml in _TOML_WORDS.items():
        text = text.replace(f"`{of_json}`", of_toml)
    return text[:1].lower() + text[1:].replace("`", "")


def _choices(type_: object) -> Sequence[object]:
    """The values that a type has, if it is one of stated values, also among other types."""
    if get_origin(type_) is Literal:
        return get_args(type_)
    inner = get_args(type_)[:1] if hasattr(type_, "__metadata__") else get_args(type_)
    return [choice for each in inner for choice in _choices(each)]


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
