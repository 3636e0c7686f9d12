"""Whether the parts of a system are of the kinds that they have to be, before any is read."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from firmware_runtime.models.qss.when import When

_BY_NAME = ("states", "equations", "parameters", "discrete", "definitions", "inputs")

_LISTS: Final = (
    ("events", When, 'a list of When("x crosses 0", ...)'),
    ("outputs", str, "a list of expressions as text"),
)


def shape_faults(system: object) -> Iterator[str]:
    """What of a `System` is no mapping by name, no expression as text, no list of events."""
    for group in _BY_NAME:
        given: object = getattr(system, group)
        if not isinstance(given, Mapping):
            yield f"{group} is {given!r}; expected a dictionary, by name"
            continue
        yield from (
            f"{group}: {name!r} is no name; expected a text"
            for name in given
            if not isinstance(name, str)
        )
        if group in {"equations", "definitions"}:
            yield from _text_faults(group, given)
    for group, kind, expected in _LISTS:
        yield from _list_faults(group, getattr(system, group), kind, expected)


def _text_faults(group: str, given: Mapping[str, object]) -> Iterator[str]:
    for name, text in given.items():
        if not isinstance(text, str):
            yield f"{group}: {name} is {text!r}; expected an expression as text, such as '-x'"


def _list_faults(group: str, given: object, kind: type, expected: str) -> Iterator[str]:
    if isinstance(given, str) or not isinstance(given, Sequence):
        yield f"{group} is {given!r}; expected {expected}"
        return
    for number, each in enumerate(given, 1):
        if not isinstance(each, kind):
            yield f"{group}: {each!r}; expected {expected}"
        elif isinstance(each, When):
            only_if = {} if each.only_if is None else {"only_if": each.only_if}
            yield from _text_faults(f"{group}: {number}", {"event": each.event, **only_if})
