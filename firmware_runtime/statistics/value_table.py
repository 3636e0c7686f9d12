"""Values of ports as cells of a table: a column for each field, numbers where all are numbers."""

from collections.abc import Iterable, Iterator
from typing import Any, Final, TypeAlias

from firmware_runtime.statistics.json_values import plain

ALONE: Final = "value"
"""The column of a value that has no fields."""
Column: TypeAlias = list[Any]


def wide_columns(values: Iterable[object]) -> dict[str, Column]:
    """A row for each value, a column for each field; one that a value has not is empty there."""
    rows = [dict(cells_of(plain(value))) for value in values]
    names = dict.fromkeys(name for row in rows for name in row)
    return {name or ALONE: _of_one_kind([row.get(name) for row in rows]) for name in names}


def beside(own: dict[str, Column], fields: dict[str, Column]) -> dict[str, Column]:
    """The table's own columns, then those of fields; a field of the same name is `value.NAME`."""
    named = {f"{ALONE}.{name}" if name in own else name: each for name, each in fields.items()}
    return own | named


def within_64_bits(cells: Column) -> Column:
    """As they are; as texts where one is a whole number that has no room in 64 bits."""
    if all(type(each) is not int or -(1 << 63) <= each < 1 << 63 for each in cells):
        return cells
    return [None if each is None else str(each) for each in cells]


def cells_of(value: object, name: str = "") -> Iterator[tuple[str, object]]:
    """Fields of a value at any depth, such as `acceleration.0`; empty for a value that has none."""
    parts: Iterable[tuple[object, object]] = ()
    if isinstance(value, dict):
        parts = value.items()
    elif isinstance(value, list):
        parts = enumerate(value)
    else:
        yield name, value
    for key, each in parts:
        yield from cells_of(each, f"{name}.{key}" if name else str(key))


def number_of(cell: object) -> float | None:
    """A cell as a number; None for what is none, or beyond any float."""
    if cell in {"nan", "inf", "-inf"} or isinstance(cell, int | float):
        try:
            return float(cell)
        except OverflowError:  # a whole number beyond any float: as text
            return None
    return None


def _of_one_kind(cells: Column) -> Column:
    """As they are where all are of one kind; as numbers, or else as texts, where they are not."""
    kinds = {type(each) for each in cells if each is not None}
    if len(kinds) < 2 and str not in kinds:  # such as "inf", which is a number
        return cells
    numbers = [None if each is None else number_of(each) for each in cells]
    if all((number is None) == (cell is None) for number, cell in zip(numbers, cells, strict=True)):
        return numbers
    return [None if each is None else str(each) for each in cells]
