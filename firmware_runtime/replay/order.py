"""Values with sets in them: a set of texts has another order in each process, and is the same."""

from dataclasses import fields, is_dataclass
from typing import Any

from msgspec import Struct

from firmware_runtime.blackbox.section import encode_sent


def is_same_but_for_order(value: Any, form: Any) -> bool:  # noqa: ANN401 -- whatever a port carries
    """Whether a value would have been written in this form, had its sets stood in that order."""
    if isinstance(value, set | frozenset):
        return isinstance(form, list) and sorted(map(_written, value)) == sorted(
            map(_written, form)
        )
    if isinstance(value, list | tuple):
        pairs = zip(value, form, strict=False) if isinstance(form, list) else ()
        return isinstance(form, list) and len(value) == len(form) and _are_same(pairs)
    if isinstance(value, dict):
        if not isinstance(form, dict) or [*map(_written, value)] != [*map(_written, form)]:
            return False
        return _are_same(zip(value.values(), form.values(), strict=True))
    if (names := _fields_of(value)) and isinstance(form, dict) and form.keys() <= set(names):
        return _are_same((getattr(value, name), form[name]) for name in form)
    return _written(value) == _written(form)


def _are_same(pairs: Any) -> bool:  # noqa: ANN401 -- of values and forms
    return all(is_same_but_for_order(*pair) for pair in pairs)


def _fields_of(value: Any) -> tuple[str, ...]:  # noqa: ANN401 -- as above
    if isinstance(value, Struct):
        return value.__struct_fields__
    return tuple(each.name for each in fields(value)) if is_dataclass(value) else ()


def _written(value: object) -> bytes:
    return encode_sent([0, value])
