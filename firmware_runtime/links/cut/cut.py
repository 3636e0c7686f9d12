"""Where a model is cut: the ports whose values cross, their numbers, and how these are packed."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from operator import itemgetter
from typing import Any, TypeAlias

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.packed import Packing

Limits: TypeAlias = tuple[float, float]
"""The least and the greatest number that a value may hold."""


@dataclass(frozen=True, slots=True, eq=False)
class Crossing:
    """One output port of the whole model whose values cross the cut."""

    name: str
    """Its path, such as `imu.sample`."""
    number: int
    """Its place among all crossings by name, which is the same at both ends."""
    packing: Packing
    limits: Limits | None = None

    def packed(self, values: Sequence[object]) -> bytes:
        """The bytes of values. Raises ModelError for one that the port does not carry."""
        try:
            return self.packing.pack_all(values)
        except Exception as error:
            shown = ", ".join(map(repr, values))
            raise ModelError(f"{shown} cannot cross the link: {error}", where=self.name) from error

    def unpacked(self, body: bytes) -> list[object]:
        """The values of these bytes. Raises Refused."""
        return self.packing.unpack_all(body, self.limits)


@dataclass(frozen=True, slots=True)
class Cut:
    """A cut as seen from one end: what it sends and what it takes."""

    leaving: tuple[Crossing, ...]
    entering: tuple[Crossing, ...]
    digest: bytes
    """SHA-256 over names, types and rules in order of the numbers: equal at ends that fit."""

    @property
    def names(self) -> tuple[str, ...]:
        """All crossings, in order of their numbers."""
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
    packings = _packings(part.model.name, kinds)
    crossings = {
        name: Crossing(name, number, packing, (limits or {}).get(name))
        for number, (name, packing) in enumerate(packings.items())
    }
    text = "\n".join(
        f"{name} {packing.text}{' ordered' if name in ordered else ''}"
        for name, packing in packings.items()
    )
    return Cut(
        _some(crossings, part.leaving),
        _some(crossings, part.entering),
        sha256(text.encode()).digest(),
    )


def _packings(model: str, kinds: Mapping[str, type[Any]]) -> dict[str, Packing]:
    packings: dict[str, Packing] = {}
    faults: list[str] = []
    for name, kind in kinds.items():
        try:
            packings[name] = Packing(kind)
        except (TypeError, NameError, RecursionError) as error:
            found = f"roles: {name}: its values cannot cross a link: {error}"
            faults.append(f"{found}; expected fields with types down to numbers and texts")
    if faults:
        raise ConfigError(model, faults)
    return packings


def _some(crossings: Mapping[str, Crossing], names: Iterable[str]) -> tuple[Crossing, ...]:
    return tuple(crossings[name] for name in sorted(names) if name in crossings)
