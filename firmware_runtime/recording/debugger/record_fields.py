"""The fields of the classes of which values are records: dataclasses, named tuples and Structs."""

from collections.abc import Iterator
from typing import Any


def fields_of(kind: type[Any]) -> tuple[str, ...]:
    """The names of a record's fields, in order; none of a class that is no record."""
    stated = ("__dataclass_fields__", "__struct_fields__", "_fields")
    return next((tuple(getattr(kind, each)) for each in stated if hasattr(kind, each)), ())


def may_have(kind: type[Any], name: str) -> bool:
    """Whether a value of this class can have an attribute: as a field or as what a class has."""
    return any(name in fields_of(each) or hasattr(each, name) for each in _with_derived(kind))


def _with_derived(kind: type[Any]) -> Iterator[type[Any]]:
    yield kind
    for each in kind.__subclasses__():
        yield from _with_derived(each)
