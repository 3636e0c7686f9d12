"""The cut around a part of a model: what enters it and what leaves it, by name.

What leaves goes by the atomic's port that sent it, as in every trace and recording:
`controller.allocation.forces`. What enters does so too where one port alone sends it, else by the
component's port at which it crosses the cut, and what came from outside of the whole by the model's
own input port, `yaw_reference`. At a part that runs alone all enters at a port that is named after
where it crosses, `imu:sample` for `imu.sample`.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort
from firmware_runtime.devs.wiring import sources_of


@dataclass(frozen=True, slots=True)
class Entrance:
    """A port at which values enter, and how many of the part's atomics are declared before it.

    What was sent by a component that stands after them was sent after what they sent. `name` is
    what the values go by.
    """

    port: AnyPort
    position: int
    name: str


@dataclass(frozen=True, slots=True)
class Cut:
    """What crosses the cut around some components of a model, in order of the couplings."""

    names: tuple[str, ...]
    entrances: dict[str, Entrance]
    """By the component's port at which it crosses, as links name it."""
    leaving: dict[str, AnyPort]
    """By what the values go by."""
    atomics: tuple[Atomic, ...]
    """The part's own, in order of declaration."""


def cut_around(model: Coupled, names: Collection[str]) -> Cut:
    """The cut around these components; the model stays as it is."""
    within = [component for name, component in model.components.items() if name in names]
    atomics = tuple(atomic for component in within for atomic in _atomics(component))
    entering: dict[str, AnyPort] = {}
    leaving: dict[str, AnyPort] = {}
    for source, destination in model.couplings:
        if destination.owner in within and source.owner not in within:
            entering.setdefault(_name(model, source), source)
        elif source.owner in within and destination.owner not in within:
            leaving |= {_name(model, each): each for each in _leaving(source)}
    positions = _positions(model, names)
    named = _named(model, entering, atomics)
    entrances = {
        crossing: Entrance(
            source, 0 if source.owner is model else positions[source.owner.name], named[crossing]
        )
        for crossing, source in entering.items()
    }
    return Cut(tuple(each.name for each in within), entrances, leaving, atomics)


def entrance_of(model: Coupled, crossing: str) -> InPort[Any] | None:
    """The input port of a part that runs alone at which what crosses there enters."""
    return model.in_ports.get(crossing.replace(".", ":"))


def type_name(kind: type[object]) -> str:
    """A type by module and name."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _name(model: Coupled, port: AnyPort) -> str:
    return port.path.removeprefix(f"{model.path}.").replace(":", ".")


def _leaving(port: AnyPort) -> list[AnyPort]:
    """The ports within the component that send what leaves by this one.

    Itself where an input leads straight to it: a part that runs alone cannot tell who sent that.
    """
    senders = list(dict.fromkeys(sources_of(port, port.owner.in_ports.values())))
    is_own = bool(senders) and all(isinstance(each, OutPort) for each in senders)
    return senders if is_own else [port]


def _named(
    model: Coupled, entering: Mapping[str, AnyPort], atomics: Collection[Atomic]
) -> dict[str, str]:
    """What the values go by that cross at each of these ports.

    Of one port that sends at two, and of one of the part's own whose values come back, each
    crossing has its own name: over a link its values come on their own.
    """
    senders = {crossing: _senders(model, port) for crossing, port in entering.items()}
    counts = Counter(each for ports in senders.values() for each in ports)
    return {
        crossing: _name(model, ports[0])
        if len(ports) == 1 and counts[ports[0]] == 1 and ports[0].owner not in atomics
        else crossing
        for crossing, ports in senders.items()
    }


def _senders(model: Coupled, port: AnyPort) -> list[AnyPort]:
    """The atomics' output ports, and the model's own inputs, that send what passes this one."""
    return list(dict.fromkeys(sources_of(port, model.in_ports.values())))


def _positions(model: Coupled, names: Collection[str]) -> dict[str, int]:
    """How many atomics of the part are declared before each component of the model."""
    before, count = {}, 0
    for name, component in model.components.items():
        before[name] = count
        count += len(list(_atomics(component))) if name in names else 0
    return before


def _atomics(component: Component) -> Iterator[Atomic]:
    return (each for each in with_all_below(component) if isinstance(each, Atomic))
