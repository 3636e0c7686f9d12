"""Where two states of a robot differ, floats to the bit: compared as the forms they are kept in."""

from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

from firmware_runtime.recording.blackbox.state.rows import ABSENT as ABSENT_FORM
from firmware_runtime.recording.records import UnknownValue
from firmware_runtime.recording.values import Plain, field_names, numbers_in, pack


class FieldDifference(NamedTuple):
    """One field that differs: `controller.yaw._integral`; a value that is not there is `ABSENT`."""

    path: str
    recorded: object
    present: object

    def __str__(self) -> str:
        return f"{self.path}: {self.recorded!r} was recorded; {self.present!r} is present"


class Absent:
    """In place of what one of two states does not have."""

    def __repr__(self) -> str:
        return "nothing"


ABSENT: Final = Absent()


def between(path: str, recorded: Plain, present: Plain) -> Iterator[FieldDifference]:
    """What differs from here on."""
    if _is_same(recorded, present):
        return
    parts = _parts(recorded), _parts(present)
    if None in parts or _tagged(recorded)[0] != _tagged(present)[0]:
        yield FieldDifference(path, in_plain(recorded), in_plain(present))
        return
    was, now = (dict(part or ()) for part in parts)
    for step in [*was, *(each for each in now if each not in was)]:
        yield from between(f"{path}{step}", was.get(step, ABSENT_FORM), now.get(step, ABSENT_FORM))
    if [*was] != [*now] and was.keys() == now.keys():
        yield FieldDifference(f"{path} (the order of its keys)", [*was], [*now])


def in_plain(form: Plain) -> Any:  # noqa: ANN401 -- whatever a model holds
    """A form as plain values that one reads: no object of a class is made."""
    if form == ABSENT_FORM:
        return ABSENT
    if isinstance(form, list):
        return tuple(in_plain(each) for each in form)
    name, parts = _tagged(form)
    if name in _PAIRS:
        return {str(in_plain(key)): in_plain(each) for key, each in parts}
    if name in _ITEMS:
        return [in_plain(each) for each in _ITEMS[name](parts)]
    if name in _NUMBERS:
        return numbers_in(form)
    return form if name is None else {name: [in_plain(each) for each in parts]}


_PAIRS: Final = frozenset({"dict", "ordered"})
_ITEMS: Final[dict[str, Callable[[Any], list[Plain]]]] = {
    "list": lambda parts: parts,
    "set": lambda parts: parts,
    "frozenset": lambda parts: parts,
    "deque": lambda parts: parts[0],
}
_UNORDERED: Final = frozenset({"set", "frozenset"})
_NUMBERS: Final = frozenset({"array", "scalar", "numbers"})


def _tagged(form: Plain) -> tuple[Any, Any]:
    """The word of a form and what stands behind it; None for one that has none."""
    if not isinstance(form, dict) or len(form) != 1:
        return None, None
    ((name, parts),) = form.items()
    is_tag = isinstance(name, str) and isinstance(parts, list)
    return (name, parts) if is_tag else (None, None)


def _is_same(recorded: Plain, present: Plain) -> bool:
    return type(recorded) is type(present) and pack(recorded) == pack(present)


def _parts(form: Plain) -> list[tuple[str, Plain]] | None:
    """The parts of a form with the steps to them; None for one that is compared as a whole."""
    if isinstance(form, list):
        return _placed(form)
    name, parts = _tagged(form)
    if name in _PAIRS:
        return [(f"[{_named(key)}]", each) for key, each in parts]
    if name in _ITEMS and name not in _UNORDERED:
        return _placed(_ITEMS[name](parts))
    if name in {"array", "numbers"}:
        found = numbers_in(form)
        is_flat = isinstance(found, list) and not any(isinstance(each, list) for each in found)
        return _placed(found) if is_flat and _are_plain(found) else None
    return None if name is None else _fields(name, parts)


def _named(key: Plain) -> str:
    """A key in words; of what is no number also which bits it has."""
    said = f"{in_plain(key)!r:.80}"
    return f"{said} {pack(key).hex()}" if "nan" in said else said


def _placed(items: list[Plain]) -> list[tuple[str, Plain]]:
    return [(f"[{place}]", each) for place, each in enumerate(items)]


def _are_plain(numbers: list[Any]) -> bool:
    return all(type(each) in (bool, int, float) and -_LARGE <= each < _LARGE for each in numbers)


_LARGE: Final = 1 << 63


def _fields(name: str, parts: list[Plain]) -> list[tuple[str, Plain]] | None:
    """Of a record, its fields by name."""
    try:
        names = field_names(name) if ":" in name else ()
    except UnknownValue:
        return None
    if len(names) != len(parts):
        return None
    return [(f".{field}", each) for field, each in zip(names, parts, strict=True)]
