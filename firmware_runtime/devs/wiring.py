"""Closure under coupling: a tree of models becomes a flat list of atomics and direct wires.

Done once, before the run, in time linear in the number of couplings. What is left of the tree are
names. From each atomic's output port, and from each input port of the root, the couplings are
followed down (EIC), across (IC), up (EOC) and straight through to the atomic input ports they end
in, in order of declaration, depth first. A port of a coupled model is a place a wire leads through,
never an end; `sources_of` lists the ports that reach it. Wires straight through coupled models
could form an endless loop; that is refused.
"""

from collections import defaultdict
from collections.abc import Container, Iterator
from typing import Any, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component, check_constructed
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort

Ends: TypeAlias = list[InPort[Any]]
"""The input ports of atomics that a value reaches, in order of delivery."""
Feed: TypeAlias = tuple[OutPort[Any], Ends]
"""An output port, and where what it sends ends."""


class Wiring:
    """The atomics of a model, in order of declaration, and where each port leads."""

    def __init__(self, root: Component) -> None:
        self.atomics: list[Atomic] = []
        self._drawn: defaultdict[AnyPort, list[Any]] = defaultdict(list)
        self._through: dict[AnyPort, Ends | None] = {}
        self._take_in(root)
        for port, destinations in self._drawn.items():
            if any(destination.owner is port.owner for destination in destinations):
                self._ends_through(port)

    def ends(self, port: AnyPort) -> Ends:
        """Where a value goes that is put into `port`, an output port or a coupled model's input."""
        ends: Ends = []
        for destination in self._drawn.get(port, ()):
            if isinstance(destination.owner, Atomic):
                ends.append(destination)
            else:
                ends += self._ends_through(destination)
        return ends

    def _ends_through(self, port: AnyPort) -> Ends:
        """The ends behind a coupled model's port, found once however many wires lead through it."""
        if port not in self._through:
            self._through[port] = None  # under way
            self._through[port] = self.ends(port)
        ends = self._through[port]
        if ends is None:
            raise CouplingError(
                "its wires lead back to it and through no atomic model",
                where=port.path,
                expected="one in the loop",
            )
        return ends

    def _take_in(self, component: Component) -> None:
        check_constructed(component)
        if isinstance(component, Atomic):
            self.atomics.append(component)
        elif isinstance(component, Coupled):
            for source, destination in component.couplings:
                self._drawn[source].append(destination)
            for child in component.components.values():
                self._take_in(child)
        else:
            raise CouplingError("a component is an Atomic or a Coupled model", where=component.path)


def sources_of(port: AnyPort, entries: Container[AnyPort] = ()) -> Iterator[AnyPort]:
    """The ports that reach `port`, one for each route: of atomics, or input ports of the root.

    The latter are the `entries`.
    """
    if port in entries or isinstance(port.owner, Atomic):
        yield port
        return
    drawn_in = port.owner if isinstance(port, OutPort) else port.owner.parent
    if isinstance(drawn_in, Coupled):
        for source, destination in drawn_in.couplings:
            if destination is port:
                yield from sources_of(source, entries)
