"""The cut around a part of a model: what enters it and what leaves it, by name.

A value that crosses the cut has the name of the output port that sent it in the whole model,
`imu.sample`; one that came from outside of the whole has the name of the model's own input port,
`yaw_reference`. A part that runs alone has the same names: its port `imu:sample` is `imu.sample`.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import AnyPort, InPort


@dataclass(frozen=True, slots=True)
class Entrance:
    """A port at which values enter, and how many of the part's atomics are declared before it.

    What was sent by a component that stands after them was sent after what they sent.
    """

    port: AnyPort
    position: int


@dataclass(frozen=True, slots=True)
class Cut:
    """What crosses the cut around some components of a model, in order of the couplings."""

    names: tuple[str, ...]
    entrances: dict[str, Entrance]
    leaving: dict[str, AnyPort]
    atomics: tuple[Atomic, ...]
    """The part's own, in order of declaration."""


def cut_around(model: Coupled, names: Collection[str]) -> Cut:
    """The cut around these components; the model stays as it is."""
    within = [component for name, component in model.components.items() if name in names]
    entrances: dict[str, Entrance] = {}
    leaving: dict[str, AnyPort] = {}
    positions = _positions(model, names)
    for source, destination in model.couplings:
        name = _name(model, source)
        if destination.owner in within and source.owner not in within:
            position = 0 if source.owner is model else positions[source.owner.name]
            entrances.setdefault(name, Entrance(source, position))
        elif source.owner in within and destination.owner not in within:
            leaving.setdefault(name, source)
    atomics = tuple(atomic for component in within for atomic in _atomics(component))
    return Cut(tuple(each.name for each in within), entrances, leaving, atomics)


def entrance_of(model: Coupled, name: str) -> InPort[Any] | None:
    """The input port of a part that runs alone at which a value of this name enters."""
    return model.in_ports.get(name.replace(".", ":"))


def type_name(kind: type[object]) -> str:
    """A type by module and name."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _name(model: Coupled, port: AnyPort) -> str:
    return port.path.removeprefix(f"{model.path}.").replace(":", ".")


def _positions(model: Coupled, names: Collection[str]) -> dict[str, int]:
    """How many atomics of the part are declared before each component of the model."""
    before, count = {}, 0
    for name, component in model.components.items():
        before[name] = count
        count += len(list(_atomics(component))) if name in names else 0
    return before


def _atomics(component: Component) -> Iterator[Atomic]:
    return (each for each in with_all_below(component) if isinstance(each, Atomic))
