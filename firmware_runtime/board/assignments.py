"""Overrides of a board's file: values of a program as `KEY=VALUE`, the value in TOML, and back."""

import tomllib
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from os import PathLike, fspath

from firmware_runtime.errors import ConfigError


def assignments_of(values: Mapping[str, object]) -> list[str]:
    """One override for each value, by its dotted key. Raises ConfigError, naming every fault."""
    if not isinstance(values, Mapping):
        raise ConfigError("set", [f"{values!r}: expected values by their keys, {{KEY: VALUE}}"])
    faults: list[str] = []
    assignments: list[str] = []
    for key, value in values.items():
        try:
            assignments.append(f"{key}={_toml(value)}")
        except TypeError as error:
            faults.append(f"{key}: {error}")
    if faults:
        raise ConfigError("set", faults)
    return assignments


def set_words(assignments: Sequence[str]) -> list[str]:
    """Overrides as words of a command line."""
    return [word for each in assignments for word in ("--set", each)]


def assigned(assignment: str) -> tuple[str, object]:
    """Key and value of `KEY=VALUE`, the value in TOML, or else a plain text."""
    key, _, text = assignment.partition("=")
    try:
        return key.strip(), tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return key.strip(), text.strip()


def _toml(value: object) -> str:
    """A value as TOML; numbers may be numpy's. Raises TypeError for what TOML has no word for."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, str | PathLike):
        from json import dumps  # noqa: PLC0415 -- a start without assignments needs none of it

        return dumps(fspath(value))
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return f"{{{', '.join(f'{_toml(key)} = {_toml(each)}' for key, each in value.items())}}}"
    expected = "a number, a text, true or false, or a list or table of these"
    raise TypeError(f"{value!r}: expected {expected}")
