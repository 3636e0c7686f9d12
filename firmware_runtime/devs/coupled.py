"""The coupled model: components, and couplings drawn one wire a line."""

from collections.abc import Sequence
from typing import TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.errors import CouplingError
from firmware_runtime.devs.ports import InPort, OutPort

C = TypeVar("C", bound=Component)
T = TypeVar("T")

AnyPort = InPort[object] | OutPort[object]


class Coupled(Component):
    """Components and the couplings between their ports, in order of declaration.

    A coupling is one of three, told by who owns its ends: from an input port of this model to one
    of a component (EIC), between components (IC), from a component to an output port of this model
    (EOC). Anything else is refused here, at construction.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.components: dict[str, Component] = {}
        self.couplings: list[tuple[AnyPort, AnyPort]] = []

    def add(self, component: C) -> C:
        """Take a component in; returns it, so that construction is one line."""
        if component.parent is not None:
            raise CouplingError(f"{component.path} is already part of {component.parent.path}")
        if component is self or component.name in self.components:
            raise CouplingError(f"{self.path}: component {component.name!r} is declared twice")
        component.parent = self
        self.components[component.name] = component
        return component

    def couple(self, source: OutPort[T] | InPort[T], destination: InPort[T] | OutPort[T]) -> None:
        """Draw one wire from `source` to `destination`."""
        self._refuse_wrong_owners(source, destination)
        if not issubclass(source.type, destination.type):
            raise CouplingError(
                f"{source.path} -> {destination.path}: a port of {source.type.__name__} "
                f"cannot feed a port of {destination.type.__name__}"
            )
        wire: tuple[AnyPort, AnyPort] = (source, destination)  # type: ignore[assignment]
        if any(source is a and destination is b for a, b in self.couplings):
            raise CouplingError(f"{source.path} -> {destination.path}: coupled twice")
        self.couplings.append(wire)

    def select(self, imminent: Sequence[Component]) -> Component:
        """Choose who goes first, for the classic simulator; default: order of declaration."""
        return imminent[0]

    def _refuse_wrong_owners(self, source: object, destination: object) -> None:
        if not isinstance(source, InPort | OutPort) or not isinstance(destination, InPort | OutPort):
            raise CouplingError(f"{self.path}: a coupling joins two ports, not "
                                f"{source!r} and {destination!r}")
        external_input = source.owner is self and isinstance(source, InPort)
        from_component = source.owner.parent is self and isinstance(source, OutPort)
        to_component = destination.owner.parent is self and isinstance(destination, InPort)
        external_output = destination.owner is self and isinstance(destination, OutPort)
        wire = f"{source.path} -> {destination.path}"
        if not (external_input or from_component):
            raise CouplingError(f"{wire}: the source is neither an input of {self.path} "
                                "nor an output of one of its components")
        if not (to_component or external_output):
            raise CouplingError(f"{wire}: the destination is neither an output of {self.path} "
                                "nor an input of one of its components")
        if source.owner is destination.owner:
            raise CouplingError(f"{wire}: a model's port cannot be coupled to the model itself")
