"""Parts of a coupled model's picture: nodes in columns, wires between their ends.

A node is a component's box, a port of the coupled model itself at its left or right edge, or a bend
where a wire passes through a column on its way further right.
"""

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from typing import Final

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.view.diagram.canvas import BOLD, Point, text_width
from firmware_runtime.view.diagram.diagram_look import NAME_SIZE

PORT_SIZE: Final = 11
PITCH: Final = 20
"""From one port of a box to the next."""
HEADER: Final = 32
"""Room for an atomic model's name."""


@dataclass(eq=False, slots=True)
class Node:
    """Something at a place in a column; `y` and `x` are those of its upper left corner."""

    width: float
    height: float
    clearance: float
    """Free space above and below."""
    weight: float
    """Resistance to giving way to others."""
    column: int = 0
    x: float = 0.0
    y: float = 0.0


@dataclass(eq=False, slots=True)
class End:
    """End of a wire: a node, and how far below its top."""

    node: Node
    offset: float

    @property
    def y(self) -> float:
        """Below the picture's top."""
        return self.node.y + self.offset


@dataclass(eq=False, slots=True)
class Wire:
    """A coupling, or a piece of one; wires of one `net` begin at the same port."""

    net: Hashable
    start: End
    end: End

    @property
    def is_feedback(self) -> bool:
        """Return whether it leads back, not to the right."""
        return self.end.node.column <= self.start.node.column


@dataclass(eq=False, slots=True)
class Box:
    """A model's picture: its size, its ports' heights, and for a coupled one what is inside."""

    model: Component
    width: float
    height: float
    inputs: dict[str, float] = field(default_factory=dict)
    """Distance of each input port below the top, at the left edge."""
    outputs: dict[str, float] = field(default_factory=dict)
    """Distance of each output port below the top, at the right edge."""
    parts: list[tuple[Node, "Box"]] = field(default_factory=list)
    routes: list[tuple[AnyPort, AnyPort, list[Point]]] = field(default_factory=list)
    """Each coupling and the points of its wire."""


def atomic_box(model: Component) -> Box:
    """The box of a model that shows nothing but its name and ports."""
    inputs = _ports(model.in_ports)
    outputs = _ports(model.out_ports)
    rows = max(len(inputs), len(outputs), 1)
    ports = label_width(inputs) + label_width(outputs) + 34
    name = text_width(model.name, NAME_SIZE) * BOLD + 24
    return Box(model, max(ports, name), HEADER + rows * PITCH + 2, inputs, outputs)


def label_width(labels: Iterable[str]) -> float:
    """Return the width of the widest port label."""
    return max((text_width(label, PORT_SIZE) for label in labels), default=0.0)


def _ports(names: Iterable[str]) -> dict[str, float]:
    return {name: HEADER + (number + 0.4) * PITCH for number, name in enumerate(names)}
