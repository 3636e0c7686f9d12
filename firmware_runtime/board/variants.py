"""Keys that only one variant of a table has, such as the serial port of a sonar that has one.

A schema marks such a key with `only`: it is there only where another key of the same table, the
choice, has one of some values. Anywhere else it would have no effect, and is refused.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

Table = dict[str, Any]
_ONLY = "only"


class Only(NamedTuple):
    """Which key makes the choice, and the values with which the marked key is there."""

    choice: str
    values: tuple[str, ...]


def only(choice: str, *values: str) -> Meta:
    """Mark a key: it is there only where the key `choice` has one of these values."""
    return Meta(extra={_ONLY: Only(choice, values)})


def foreign_keys(
    table: Mapping[str, Any], schema: type[msgspec.Struct]
) -> Iterator[tuple[str, str]]:
    """The keys of a table that its choices rule out, and why.

    A choice that is wrong itself rules out nothing.
    """
    hints = get_type_hints(schema, include_extras=True)
    defaults = {field.encode_name: field.default for field in msgspec.structs.fields(schema)}
    for key in table:
        mark = _mark(hints.get(key))
        if mark is None:
            continue
        chosen = table.get(mark.choice, defaults[mark.choice])
        if chosen in get_args(hints[mark.choice]) and chosen not in mark.values:
            wanted = " or ".join(map(repr, mark.values))
            yield key, f"{mark.choice} is {chosen!r}, and only {wanted} has such a key"


def drop_replaced(
    table: Table, schema: type[msgspec.Struct], assigned: Collection[str], path: str = ""
) -> None:
    """Where an assignment makes the choice, drop the file's keys of the variant it replaces."""
    hints = get_type_hints(schema, include_extras=True)
    for key, _ in [*foreign_keys(table, schema)]:
        mark = _mark(hints[key])
        if mark is not None and path + mark.choice in assigned and path + key not in assigned:
            del table[key]
    for name, hint in get_type_hints(schema).items():
        for key, inner, inner_schema in _tables(name, hint, table.get(name)):
            drop_replaced(inner, inner_schema, assigned, f"{path}{key}.")


def is_struct(type_: Any) -> bool:
    """Whether this is the schema of a table."""
    return isinstance(type_, type) and issubclass(type_, msgspec.Struct)


def _mark(hint: Any) -> Only | None:
    metadata = [each.extra for each in getattr(hint, "__metadata__", ()) if isinstance(each, Meta)]
    marks = [extra[_ONLY] for extra in metadata if extra and _ONLY in extra]
    return marks[0] if marks else None


def _tables(name: str, hint: Any, value: Any) -> Iterator[tuple[str, Table, type[msgspec.Struct]]]:
    """The tables in a value and their schema: the value itself, or those it holds by name."""
    schemas = [each for each in (hint, *get_args(hint)) if is_struct(each)]
    if schemas and isinstance(value, dict):
        inner = value.items() if get_origin(hint) is dict else [("", value)]
        for key, table in inner:
            if isinstance(table, dict):
                yield f"{name}.{key}".rstrip("."), table, schemas[0]
