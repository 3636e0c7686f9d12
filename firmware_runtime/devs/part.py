"""A part of a coupled model: some of its components, cut off from the others at the couplings.

    whole:  imu.sample -> controller.sample        controller.forces -> thrust_pairs.forces
    part:   imu:sample -> controller.sample        controller.forces -> controller:forces

A coupling that the cut crosses ends at a port of the part, made from the typed ports it joined: an
input port where it came in, an output port where it went out, each named after the output port that
feeds it, with a colon for the dot that no name may hold. Components keep their paths, so traces,
statistics and settings name them as in the whole.
"""

from collections.abc import Collection
from typing import Any

from msgspec import Struct

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort


class Part(Struct, frozen=True):
    """Some components of a model, in a coupled model of the same name.

    `entering` and `leaving` are the ports at which the cut crossed couplings, in their order, by
    the path of the output port that fed them in the whole model: `imu.sample`. Ports that the
    whole model had itself are kept where something is coupled to them.
    """

    model: Coupled
    entering: dict[str, InPort[Any]]
    leaving: dict[str, OutPort[Any]]


def part_of(whole: Coupled, names: Collection[str]) -> Part:
    """Take these components out of a model; it must not be used any more.

    Raises CouplingError for a name that is none of its components'.
    """
    unknown = [name for name in names if name not in whole.components]
    if unknown:
        known = ", ".join(whole.components)
        raise CouplingError(
            f"no component {', '.join(unknown)}", where=whole.path, expected=f"some of {known}"
        )
    part = Part(Coupled(whole.name), {}, {})
    for name, component in whole.components.items():
        if name in names:
            component.parent = None
            part.model.add(component)
    for source, destination in whole.couplings:
        _draw(part, whole, source, destination)
    return part


def _draw(part: Part, whole: Coupled, source: AnyPort, destination: AnyPort) -> None:
    """One coupling of the whole, as far as the cut leaves it."""
    model, path = part.model, source.path.removeprefix(f"{whole.path}.")
    has_begin = source.owner is whole or source.owner.parent is model
    has_end = destination.owner is whole or destination.owner.parent is model
    if has_begin and has_end:
        begin, end = _own(model, whole, source), _own(model, whole, destination)
    elif has_end and destination.owner is not whole:
        begin, end = _entrance(part, path, source.type), destination
    elif has_begin and source.owner is not whole:
        begin, end = source, _exit(part, path, source.type)
    else:
        return
    if (begin, end) not in model.couplings:  # one exit serves all that the cut took away
        model.couple(begin, end)


def _own(model: Coupled, whole: Coupled, port: AnyPort) -> AnyPort:
    """A component's port itself; in place of one of the whole, the part's of the same name."""
    if port.owner is not whole:
        return port
    if isinstance(port, InPort):
        if port.name not in model.in_ports:
            model.in_port(port.name, port.type)
        return model.in_ports[port.name]
    if port.name not in model.out_ports:
        model.out_port(port.name, port.type)
    return model.out_ports[port.name]


def _entrance(part: Part, path: str, kind: type[object]) -> InPort[object]:
    if path not in part.entering:
        part.entering[path] = part.model.in_port(path.replace(".", ":"), kind)
    return part.entering[path]


def _exit(part: Part, path: str, kind: type[object]) -> OutPort[object]:
    if path not in part.leaving:
        part.leaving[path] = part.model.out_port(path.replace(".", ":"), kind)
    return part.leaving[path]
