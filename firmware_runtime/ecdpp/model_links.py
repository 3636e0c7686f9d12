"""The `in`, `out` and `Link` lines of a model file: ports, their types, and couplings."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort
from firmware_runtime.ecdpp.model_syntax import Entry, Reference, Section
from firmware_runtime.ecdpp.text import look_up

T = TypeVar("T")


def declare_ports(model: Coupled, section: Section) -> Iterator[tuple[int, str]]:
    """Give the model its ports; yields each fault and its line."""
    for entry in section.inputs:
        if fault := _taken(model.in_ports, entry):
            yield entry.line, fault
        else:
            model.in_port(entry.key, _narrowest(_types_ahead(model, section, entry.key)))
    for entry in section.outputs:
        if fault := _taken(model.out_ports, entry):
            yield entry.line, fault
        else:
            model.out_port(entry.key, _widest(_types_behind(model, section, entry.key)))


def draw_links(model: Coupled, section: Section) -> Iterator[tuple[int, str]]:
    """Couple the ports; yields each fault and its line."""
    lost = {entry.key.casefold() for entry in section.components} - {
        name.casefold() for name in model.components
    }
    for line, source, end in section.links:
        if {source.model_name, end.model_name} & lost:
            continue  # the component could not be built: that is a fault already
        try:
            model.couple(_source(model, source), _end(model, end))
        except (CouplingError, LookupError) as error:
            yield line, f"Link: {error.args[0]}"


def _taken(ports: Mapping[str, AnyPort], entry: Entry) -> str:
    return "" if look_up(ports, entry.key) is None else f"port {entry.key!r} is declared twice"


# From references to ports -----------------------------------------------------------------------


def _source(model: Coupled, reference: Reference) -> InPort[Any] | OutPort[Any]:
    if reference.model is None:
        return _named(model.in_ports, reference.port, f"an input of {model.name}")
    component = _component(model, reference.model)
    return _named(component.out_ports, reference.port, f"an output of {component.name}")


def _end(model: Coupled, reference: Reference) -> InPort[Any] | OutPort[Any]:
    if reference.model is None:
        return _named(model.out_ports, reference.port, f"an output of {model.name}")
    component = _component(model, reference.model)
    return _named(component.in_ports, reference.port, f"an input of {component.name}")


def _component(model: Coupled, name: str) -> Component:
    return _named(model.components, name, f"a component of {model.name}")


def _named(known: Mapping[str, T], name: str, what: str) -> T:
    found = look_up(known, name)
    if found is None:
        raise LookupError(f"{name!r} is not {what}; expected one of {', '.join(known) or 'none'}")
    return found


# The types that coupled ports take --------------------------------------------------------------


def _types_ahead(model: Coupled, section: Section, name: str) -> list[type]:
    """Types of the components' ports that this input is linked to.

    Of an output of the model itself, the types that components bring there.
    """
    ends = [link.end for link in section.links if link.source.is_own(name)]
    own = [end.port for end in ends if end.model is None]
    through = [each for port in own for each in _types_behind(model, section, port)]
    return _types(model, [end for end in ends if end.model], _end) + through


def _types_behind(model: Coupled, section: Section, name: str) -> list[type]:
    """Types of the components' ports, and of the model's own inputs, linked to this output."""
    sources = [link.source for link in section.links if link.end.is_own(name)]
    return _types(model, sources, _source)


def _types(
    model: Coupled,
    references: Sequence[Reference],
    find: Callable[[Coupled, Reference], AnyPort],
) -> list[type]:
    types: list[type] = []
    for reference in references:
        with suppress(LookupError):  # reported when the link is drawn
            types.append(find(model, reference).type)
    return types


def _narrowest(types: Sequence[type]) -> type:
    """The type that fits all the others; without one, coupling will say what does not fit."""
    fitting = [one for one in types if all(issubclass(one, other) for other in types)]
    return (fitting or [*types, float])[0]


def _widest(types: Sequence[type]) -> type:
    """The type that all the others fit."""
    fitting = [one for one in types if all(issubclass(other, one) for other in types)]
    return (fitting or [*types, float])[0]
