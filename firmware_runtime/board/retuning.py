"""Retuning: settings that may change while a robot runs, gains and limits, by their keys."""

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from operator import getitem
from typing import Any

from msgspec import Struct, json, structs

from firmware_runtime.board import strict
from firmware_runtime.board.installed import blamed_on, definition, entry_point_of
from firmware_runtime.board.registry import Board, own_faults
from firmware_runtime.errors import ConfigError


def changed_keys(before: object, after: object) -> Iterator[str]:
    """The keys whose values differ, in full, such as `controller.yaw.kp`."""
    return (key for key, _, _ in changed_values(before, after))


def changed_values(
    before: object, after: object, prefix: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    """The keys whose values differ, in full, and both values; None where there is no such key."""
    if isinstance(before, Struct) and isinstance(after, Struct):
        tables: tuple[Any, Any] = (
            {**_choice(before), **_fields(before)},
            {**_choice(after), **_fields(after)},
        )
    elif isinstance(before, dict) and isinstance(after, dict):
        tables = (before, after)
    else:
        if before != after:
            yield prefix, before, after
        return
    for name in dict.fromkeys([*tables[0], *tables[1]]):
        path = _join(prefix, name)
        yield from changed_values(tables[0].get(name), tables[1].get(name), path)


def settings_with(board: Board, values: Mapping[str, object]) -> Any:  # noqa: ANN401 -- any board's
    """A board's settings with other values at these keys. Raises ConfigError with every fault."""
    table = _present(json.decode(json.encode(board.settings)))
    faults: list[str] = []
    for key, value in values.items():
        *parents, leaf = key.split(".")
        reduce(getitem, parents, table)[leaf] = value
    defined = definition(board.kind)
    settings = strict.convert(table, defined.settings, faults)
    if settings is not None:
        with blamed_on(entry_point_of(board.kind), "definition"):
            faults += own_faults(defined, settings)
    if faults:
        raise ConfigError(board.name, faults)
    return settings


def _present(value: object) -> Any:  # noqa: ANN401 -- any board's
    """A table without the keys that have no value."""
    if not isinstance(value, dict):
        return value
    return {key: _present(each) for key, each in value.items() if each is not None}


def retunable_values(
    settings: object, retunable: Sequence[str], prefix: str = ""
) -> dict[str, Any]:
    """Return what may change while a robot runs, by its full key, as these settings have it."""
    tables = _fields(settings) if isinstance(settings, Struct) else settings
    if not isinstance(tables, dict):
        is_meant = prefix and not need_restart([prefix], retunable)
        return {prefix: settings} if is_meant else {}
    found: dict[str, Any] = {}
    for name, value in tables.items():
        found |= retunable_values(value, retunable, _join(prefix, name))
    return found


def has_key(settings: object, key: str) -> bool:
    """Return whether these settings have a value at this key, one that may change or not."""
    return key in retunable_values(settings, [key])


def need_restart(changed: Sequence[str], retunable: Sequence[str]) -> list[str]:
    """Return the changed keys that only a new run takes up; `*` stands for any one word."""
    return [key for key in changed if not any(_matches(key, pattern) for pattern in retunable)]


def retuned(before: object, after: object, retunable: Sequence[str], prefix: str = "") -> Any:  # noqa: ANN401 -- any board's
    """The settings `before`, with nothing but what is retunable as it is in `after`."""
    if isinstance(before, Struct) and isinstance(after, Struct):
        own, new = _fields(before), _fields(after)
        return structs.replace(before, **_each_retuned(own, new, retunable, prefix))
    if isinstance(before, dict) and isinstance(after, dict):
        return _each_retuned(before, after, retunable, prefix)
    return before if need_restart([prefix], retunable) else after


def _each_retuned(
    before: dict[str, Any], after: dict[str, Any], retunable: Sequence[str], prefix: str
) -> dict[str, Any]:
    return {
        name: retuned(value, after.get(name, value), retunable, _join(prefix, name))
        for name, value in before.items()
    }


def _matches(key: str, pattern: str) -> bool:
    words, wanted = key.split("."), pattern.split(".")
    return len(words) == len(wanted) and all(
        want in {"*", word} for word, want in zip(words, wanted, strict=True)
    )


def _fields(settings: Struct) -> dict[str, Any]:
    return {name: getattr(settings, name) for name in settings.__struct_fields__}


def _choice(settings: Struct) -> dict[str, Any]:
    """The key that says which variant of a table this is, if there are variants."""
    config = settings.__struct_config__
    return {} if config.tag_field is None else {config.tag_field: config.tag}


def _join(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name
