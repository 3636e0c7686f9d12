"""The coupled model: components, and couplings drawn one wire a line."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

from firmware_runtime.devs.component import Component, below_root, check_constructed
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, Owner, Source, carries
from firmware_runtime.errors import Named

C = TypeVar("C", bound=Component)
T = TypeVar("T")


class ComponentsByName(Named[Component]):
    """Components of a model; another name raises UnknownName."""

    __slots__ = ()
    noun = "component"


class Coupled(Component):
    """Components and the couplings between their ports, in order of declaration.

    A coupling is one of four, by the owners of its ends: from an input port of this model to one
    of a component (EIC), between components (IC), from a component to an output port of this model
    (EOC), or straight from an input port of this model to an output port of it. Anything else is
    refused here, at construction. `couplings` is an ordered set of pairs (source, destination).
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.components: dict[str, Component] = ComponentsByName()
        self.couplings: dict[tuple[AnyPort, AnyPort], None] = {}

    def add(self, component: C) -> C:
        """Take a component in; returns it, so that construction is one line."""
        check_constructed(self)
        check_constructed(component)
        if component.parent is not None:
            raise CouplingError(f"{component.path} is already part of {component.parent.path}")
        if component.name in self.components:
            raise CouplingError(f"component {component.name!r} is declared twice", where=self.path)
        if isinstance(component, Coupled) and component in self._ancestry():
            raise CouplingError(f"{component.name!r} cannot be part of itself", where=self.path)
        component.parent = self
        self.components[component.name] = component
        return component

    def couple(self, source: Source[T], destination: InPort[T] | OutPort[T]) -> None:
        """Draw one wire from `source`, an input or output port, to `destination`."""
        check_constructed(self)
        wire: tuple[AnyPort, AnyPort] = (source, destination)  # type: ignore[assignment]
        begin, end = wire
        if not (
            self._can_begin(begin)
            and self._can_end(end)
            and (begin.owner is not end.owner or begin.owner is self)
            and (begin.type is end.type or carries(end.type, begin.type))
            and wire not in self.couplings
        ):
            raise CouplingError(self._misfit(begin, end))
        self.couplings[wire] = None

    def select(self, imminent: Sequence[Component]) -> Component:
        """Choose the first component, for the classic simulator; default: order of declaration."""
        return imminent[0]

    # ---------------------------------------------------------------------------------------------

    def _ancestry(self) -> list[Owner]:
        """This model and all it is part of."""
        ancestry: list[Owner] = []
        model: Owner | None = self
        while model is not None:
            ancestry.append(model)
            model = model.parent
        return ancestry

    def _can_begin(self, port: object) -> bool:
        if isinstance(port, OutPort):
            return port.owner.parent is self
        return isinstance(port, InPort) and port.owner is self

    def _can_end(self, port: object) -> bool:
        if isinstance(port, InPort):
            return port.owner.parent is self
        return isinstance(port, OutPort) and port.owner is self

    def _misfit(self, source: AnyPort, destination: AnyPort) -> str:
        """Why this coupling is refused, in one sentence."""
        for port in (source, destination):
            if not isinstance(port, InPort | OutPort):
                return f"{self.path}: a coupling joins two ports; {port!r} is none"
        wire = f"{source.path} -> {destination.path}"
        if not self._can_begin(source):
            return f"{wire}: the source is neither an input of {self.path} nor a component's output"
        if not self._can_end(destination):
            return f"{wire}: the end is neither an output of {self.path} nor a component's input"
        if source.owner is destination.owner is not self:
            return f"{wire}: a model's port cannot be coupled to the model itself"
        if (source, destination) in self.couplings:
            return f"{wire}: coupled twice"
        kinds = f"{source.type.__name__} cannot feed a port of {destination.type.__name__}"
        return f"{wire}: a port of {kinds}"


def ports_below(root: Component) -> dict[str, OutPort[object]]:
    """The output ports of a model and of all that it is made of, by their paths below it."""
    return {
        below_root(port.path): port
        for component in with_all_below(root)
        for port in component.out_ports.values()
    }


def with_all_below(component: Component) -> Iterator[Component]:
    """A component and all that it is made of, each before its own, in order of declaration."""
    yield component
    if isinstance(component, Coupled):
        for each in component.components.values():
            yield from with_all_below(each)
