"""Values with sets in them: a set of texts has another order in each process, and is the same."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import msgspec
from msgspec import Struct

from firmware_runtime.recording.blackbox.section import encode_sent
from firmware_runtime.recording.values import unpack


def is_same_but_for_order(value: Any, form: Any) -> bool:  # noqa: ANN401 -- whatever a port carries
    """Whether a value would have been written in this form, had its sets stood in that order."""
    if isinstance(value, set | frozenset):
        return isinstance(form, list | tuple) and _are_the_same(list(value), list(form))
    if isinstance(value, list | tuple):
        return isinstance(form, list | tuple) and _are_in_order(value, form)
    if isinstance(value, dict):
        if not isinstance(form, dict) or not _are_in_order([*value], [*form]):
            return False
        return _are_in_order([*value.values()], [*form.values()])
    if names := _fields_of(value):
        return _has_fields(value, form, names)
    return _written(value) == _written(form)


def _are_in_order(values: Sequence[Any], forms: Sequence[Any]) -> bool:
    pairs = zip(values, forms, strict=False)
    return len(values) == len(forms) and all(is_same_but_for_order(*pair) for pair in pairs)


def _are_the_same(values: Iterable[Any], forms: list[Any]) -> bool:
    """Whether each value has a form of its own among these, and no form is left."""
    unmatched = []
    written = [_written(each) for each in forms]
    for value in values:
        content = _written(value)
        if content in written:
            written.remove(content)
        else:
            unmatched.append(value)
    left = [unpack(each)[1] for each in written]
    for value in unmatched:
        found = next((each for each in left if is_same_but_for_order(value, each)), None)
        if found is None:
            return False
        left.remove(found)
    return not left


def _has_fields(value: Any, form: Any, names: Mapping[str, str]) -> bool:  # noqa: ANN401
    """Whether a record would have this form, a map or a list; `names` are fields by name there."""
    present = unpack(_written(value))[1]
    if isinstance(present, dict) and isinstance(form, dict) and [*present] == [*form]:
        return all(
            is_same_but_for_order(getattr(value, names[key]), each)
            if key in names
            else present[key] == each
            for key, each in form.items()
        )
    if not isinstance(present, list) or not isinstance(form, list) or len(present) != len(form):
        return False
    tags = len(present) - len(names)  # one or none, and it stands first
    values = [getattr(value, name) for name in names.values()]
    return present[:tags] == form[:tags] and _are_in_order(values, form[tags:])


def _fields_of(value: Any) -> dict[str, str]:  # noqa: ANN401 -- whatever a port carries
    if isinstance(value, Struct):
        return {each.encode_name: each.name for each in msgspec.structs.fields(value)}
    return {each.name: each.name for each in fields(value)} if is_dataclass(value) else {}


def _written(value: object) -> bytes:
    return encode_sent([0, value])
