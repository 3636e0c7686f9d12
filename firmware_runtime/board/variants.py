"""Tables of which there are variants, such as a sonar on I2C and one on a serial port.

A schema states them as a union of structs that are tagged by one key, the choice:

    class Srf08Table(SonarTable, frozen=True, tag_field="chip", tag="srf08"): ...
    class MaxbotixTable(SonarTable, frozen=True, tag_field="chip", tag="maxbotix"): ...

    sonar: Srf08Table | MaxbotixTable

The keys of one variant are no keys of another. The choice has to be stated, unless one variant says
`is_default_variant: ClassVar[bool] = True`.
"""

from collections.abc import Collection, Iterator, Mapping
from functools import cache
from types import NoneType
from typing import Any, TypeGuard, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Struct

Table = dict[str, Any]


class Variants(Struct, frozen=True):
    """The variants of one table by their tags, in order of declaration."""

    choice: str
    """The key that says which of them a table is."""
    schemas: Mapping[str, type[msgspec.Struct]]
    default: str | None

    def chosen(self, table: Mapping[str, object]) -> str | None:
        """The tag that a table states, or the default; None if that is the tag of no variant."""
        tag = table.get(self.choice, self.default)
        return tag if isinstance(tag, str) and tag in self.schemas else None

    def names(self, tag: str | None = None) -> list[str]:
        """The keys of one variant, or of all, the choice first."""
        schemas = self.schemas.values() if tag is None else (self.schemas[tag],)
        return list(dict.fromkeys([self.choice, *(key for each in schemas for key in keys(each))]))

    def foreign_keys(self, table: Mapping[str, object]) -> Iterator[tuple[str, str]]:
        """The keys of a table that only other variants than the chosen one have, and why."""
        tag = self.chosen(table)
        own = self.names(tag)
        for key in table:
            owners = [each for each, schema in self.schemas.items() if key in keys(schema)]
            if key not in own and owners:
                only = " or ".join(map(repr, owners))
                yield key, f"{self.choice} is {tag!r}, and only {only} has such a key"


def variants_of(type_: object) -> Variants | None:
    """The variants that a type consists of, be it optional; None if it is no tagged table."""
    members = [each for each in (get_args(type_) or (type_,)) if each is not NoneType]
    tagged = [each for each in members if is_struct(each) and each.__struct_config__.tag]
    if not tagged or len(tagged) != len(members):
        return None
    defaults = [_tag(each) for each in tagged if getattr(each, "is_default_variant", False)]
    choice = str(tagged[0].__struct_config__.tag_field)
    return Variants(choice, {_tag(each): each for each in tagged}, next(iter(defaults), None))


def drop_replaced(
    table: Table, schema: type[msgspec.Struct], assigned: Collection[str], path: str = ""
) -> None:
    """Drop the file's keys of a variant that an assignment replaces."""
    for name, hint in _hints(schema).items():
        for key, inner, inner_type in _tables(name, hint, table.get(name)):
            inner_path = f"{path}{key}."
            variants = variants_of(inner_type)
            if variants is None:
                drop_replaced(inner, _struct_in(inner_type), assigned, inner_path)
            elif (tag := variants.chosen(inner)) is not None:
                if inner_path + variants.choice in assigned:
                    _drop_foreign(inner, variants, assigned, inner_path)
                drop_replaced(inner, variants.schemas[tag], assigned, inner_path)


@cache
def _hints(schema: type[msgspec.Struct]) -> Mapping[str, object]:
    """Return the types of a table's keys; a robot that runs reads its file again."""
    return get_type_hints(schema)


def is_struct(type_: object) -> TypeGuard[type[Struct]]:
    """Return whether this is the schema of a table."""
    return isinstance(type_, type) and issubclass(type_, msgspec.Struct)


def keys(schema: type[msgspec.Struct]) -> list[str]:
    """The keys of a table, the choice apart."""
    return list(schema.__struct_encode_fields__)


def _tag(schema: type[msgspec.Struct]) -> str:
    return str(schema.__struct_config__.tag)


def _drop_foreign(table: Table, variants: Variants, assigned: Collection[str], path: str) -> None:
    for key, _ in [*variants.foreign_keys(table)]:
        if path + key not in assigned:
            del table[key]


def _tables(name: str, hint: object, value: object) -> Iterator[tuple[str, Table, Any]]:
    """The tables in a value and their type: the value itself, or those it holds by name."""
    if not isinstance(value, dict):
        return
    is_mapping = get_origin(hint) is dict
    type_ = get_args(hint)[1] if is_mapping else hint
    if _struct_in(type_) is None:
        return
    for key, table in value.items() if is_mapping else [("", value)]:
        if isinstance(table, dict):
            yield f"{name}.{key}".rstrip("."), table, type_


def _struct_in(type_: object) -> Any:
    """The schema of a table that may be left out, or one of its variants; None if it is none."""
    return next((each for each in (type_, *get_args(type_)) if is_struct(each)), None)
