"""Cut of a model: the ports whose values cross, their numbers, and how these are packed."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from math import isfinite
from operator import itemgetter
from typing import Any, TypeAlias

from msgspec.msgpack import Ext

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.leaf_values import ARRAY, LARGE, Form, array_of, decode, encode
from firmware_runtime.links.typed_values import packed_form

Limits: TypeAlias = tuple[float, float]
"""The least and the greatest number that a value may hold."""


@dataclass(frozen=True, slots=True, eq=False)
class Crossing:
    """One output port of the whole model whose values cross the cut."""

    name: str
    """Its path, such as `imu.sample`."""
    number: int
    """Its place among all crossings by name, which is the same at both ends."""
    form: Form
    limits: Limits | None = None

    def packed(self, values: Sequence[object]) -> bytes:
        """The bytes of values. Raises ModelError for one that the port does not carry."""
        try:
            return encode([self.form.pack(value) for value in values])
        except Exception as error:
            shown = ", ".join(map(repr, values))
            raise ModelError(f"{shown} cannot cross the link: {error}", where=self.name) from error

    def unpacked(self, body: bytes) -> list[object]:
        """Return the values of these bytes, one or more. Raises Refused.

        Every number is finite and within the limits. Bytes come from outside, and classes from any
        package: whatever they raise is Refused.
        """
        try:
            found = _checked(body, self.limits)
            if not isinstance(found, list) or not found:
                raise Refused(Reason.MALFORMED, "no array of values")  # noqa: TRY301
            return [self.form.unpack(each) for each in found]
        except Refused:
            raise
        except Exception as error:
            raise Refused(Reason.MALFORMED, str(error) or type(error).__name__) from error


@dataclass(frozen=True, slots=True)
class Cut:
    """A cut as seen from one end: what it sends and what it takes."""

    leaving: tuple[Crossing, ...]
    entering: tuple[Crossing, ...]
    digest: bytes
    """SHA-256 over names, types and rules in order of the numbers: equal at ends that fit."""

    @property
    def names(self) -> tuple[str, ...]:
        """Return all crossings, in order of their numbers."""
        found = sorted((*self.leaving, *self.entering), key=lambda each: each.number)
        return tuple(each.name for each in found)


def cut_of(
    part: Part,
    names: Collection[str],
    limits: Mapping[str, Limits] | None = None,
    ordered: Collection[str] = (),
) -> Cut:
    """The cut around a part of a model, as far as its ports are among these names.

    Ends fit that have the same ports, types and `ordered` ones.
    Raises ConfigError for all ports whose types do not say what they are made of.
    """
    ports: dict[str, AnyPort] = {**part.leaving, **part.entering}
    kinds: dict[str, type[Any]] = {
        name: port.type for name, port in sorted(ports.items(), key=itemgetter(0)) if name in names
    }
    forms = _forms(part.model.name, kinds)
    crossings = {
        name: Crossing(name, number, form, (limits or {}).get(name))
        for number, (name, form) in enumerate(forms.items())
    }
    text = "\n".join(
        f"{name} {form.text}{' ordered' if name in ordered else ''}" for name, form in forms.items()
    )
    return Cut(
        _some(crossings, part.leaving),
        _some(crossings, part.entering),
        sha256(text.encode()).digest(),
    )


def _forms(model: str, kinds: Mapping[str, type[Any]]) -> dict[str, Form]:
    forms: dict[str, Form] = {}
    faults: list[str] = []
    for name, kind in kinds.items():
        try:
            forms[name] = packed_form(kind)
        except (TypeError, NameError, RecursionError) as error:
            found = f"roles: {name}: its values cannot cross a link: {error}"
            faults.append(f"{found}; expected fields with types down to numbers and texts")
    if faults:
        raise ConfigError(model, faults)
    return forms


def _some(crossings: Mapping[str, Crossing], names: Iterable[str]) -> tuple[Crossing, ...]:
    return tuple(crossings[name] for name in sorted(names) if name in crossings)


def _checked(packed: bytes, limits: tuple[float, float] | None) -> object:
    """Return what MessagePack bears. Raises Refused for a number that is none, or too large."""
    found = decode(packed)
    for number in _numbers(found):
        _check(number, limits)
    return found


def _check(number: float, limits: tuple[float, float] | None) -> None:
    """Raises Refused."""
    if not isfinite(number):
        raise Refused(Reason.NOT_FINITE, f"{number}: expected a finite number")
    if limits is not None and not limits[0] <= number <= limits[1]:
        expected = f"expected {limits[0]:g} to {limits[1]:g}"
        raise Refused(Reason.OUT_OF_LIMITS, f"{number:g}: {expected}")


def _numbers(found: object) -> Iterator[float]:
    """Every number in what MessagePack bears, at any depth; true and false are none."""
    if isinstance(found, float) or type(found) is int:
        yield found
    elif isinstance(found, list):
        for each in found:
            yield from _numbers(each)
    elif isinstance(found, dict):
        yield from _numbers(list(found.values()))
    elif isinstance(found, Ext):
        yield from _numbers_of_extension(found)


def _numbers_of_extension(found: Ext) -> Iterator[float]:
    if found.code == ARRAY:
        yield from array_of(found).ravel().tolist()
    elif found.code == LARGE:
        yield int(bytes(found.data))
    else:
        yield from _numbers(decode(bytes(found.data)))


@dataclass(frozen=True, slots=True)
class Terms:
    """Terms of a link: `[link]` of the board, in ns; ports by the path of the output port."""

    timeout: int = SECOND // 2
    good: int = SECOND // 2
    keep: int = 1
    retain: frozenset[str] = frozenset()
    ordered: frozenset[str] = frozenset()
