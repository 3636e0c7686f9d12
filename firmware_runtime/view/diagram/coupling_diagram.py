"""The couplings of a model as SVG: boxes in boxes, ports at their edges, wires between them.

Each coupled model is laid out with all that is in it, from the inside out. Inputs are at the left
of a box, outputs at the right. A wire lights up and names both its ends under the pointer.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort, InPort, Owner
from firmware_runtime.view.diagram.boxes import (
    PORT_SIZE,
    Box,
    End,
    Node,
    Wire,
    atomic_box,
    label_width,
)
from firmware_runtime.view.diagram.canvas import BOLD, CORNER, Canvas, Point, Rectangle, text_width
from firmware_runtime.view.diagram.diagram_look import NAME_SIZE, diagram_text
from firmware_runtime.view.diagram.placement import arrange, assign
from firmware_runtime.view.diagram.routes import Routes

BOX_CLEARANCE: Final = 24
BOX_WEIGHT: Final = 1000.0
PORT_CLEARANCE: Final = 4
BEND_CLEARANCE: Final = 20
PORT_HEIGHT: Final = 16
"""With the clearance as far apart as the ports of an atomic model, so that wires run level."""
TOP: Final = 40
"""Above everything in a coupled box, room for its name."""
PADDING: Final = 16
"""Below everything in a coupled box."""


def box_of(model: Component) -> Box:
    """The model's box with everything in it."""
    return _Nest(model).box() if isinstance(model, Coupled) else atomic_box(model)


class _Nest:
    """A coupled model on its way from couplings to a box."""

    def __init__(self, model: Coupled) -> None:
        self._model = model
        self._boxes: dict[Owner, Box] = {each: box_of(each) for each in model.components.values()}
        placed = assign(list(self._boxes), list(self._between()))
        self._nodes = {
            each: Node(box.width, box.height, BOX_CLEARANCE, BOX_WEIGHT, placed[each])
            for each, box in self._boxes.items()
        }
        last = 1 + max(placed.values(), default=0)
        self._ports: dict[AnyPort, Node] = {
            port: Node(label_width([port.name]) + 14, PORT_HEIGHT, PORT_CLEARANCE, 1.0, column)
            for ports, column in ((model.in_ports, 0), (model.out_ports, last))
            for port in ports.values()
        }
        self._columns: list[list[Node]] = [[] for _ in range(last + 1)]
        for node in (*self._ports.values(), *self._nodes.values()):
            self._columns[node.column].append(node)
        self._bends: dict[tuple[AnyPort, int], Node] = {}
        self._chains = {pair: self._chain(*pair) for pair in model.couplings}

    def box(self) -> Box:
        """Lay everything out."""
        wires = [wire for chain in self._chains.values() for wire in chain]
        bottom = TOP + arrange(self._columns, [each for each in wires if not each.is_feedback])
        for node in self._all():
            node.y += TOP
        routes = Routes(len(self._columns))
        for wire in wires:
            routes.note(wire)
        width = self._place(routes)
        box = Box(self._model, width, bottom + routes.depth + PADDING)
        box.parts = [(self._nodes[each], inner) for each, inner in self._boxes.items()]
        for port, node in self._ports.items():
            heights = box.inputs if isinstance(port, InPort) else box.outputs
            heights[port.name] = node.y + PORT_HEIGHT / 2
        for (source, end), chain in self._chains.items():
            points = [point for wire in chain for point in routes.points(wire, bottom)]
            box.routes.append((source, end, self._to_the_edges(source, end, points, width)))
        return box

    # Nodes and wires ----------------------------------------------------------------------------

    def _between(self) -> Iterator[tuple[Owner, Owner]]:
        """Yield which component feeds which."""
        for source, end in self._model.couplings:
            if source.owner is not self._model and end.owner is not self._model:
                yield source.owner, end.owner

    def _chain(self, source: AnyPort, end: AnyPort) -> list[Wire]:
        """A coupling as wires from column to column, round a bend in each between."""
        first, last = self._end(source), self._end(end)
        between = range(first.node.column + 1, last.node.column)
        bends = [End(self._bend(source, column), 0.0) for column in between]
        return [Wire(source, start, stop) for start, stop in pairwise((first, *bends, last))]

    def _end(self, port: AnyPort) -> End:
        if port in self._ports:
            return End(self._ports[port], PORT_HEIGHT / 2)
        box = self._boxes[port.owner]
        heights = box.inputs if isinstance(port, InPort) else box.outputs
        return End(self._nodes[port.owner], heights[port.name])

    def _bend(self, source: AnyPort, column: int) -> Node:
        """Return the place where what comes from a port passes through a column."""
        key = source, column
        if key not in self._bends:
            self._bends[key] = Node(0.0, 0.0, BEND_CLEARANCE, 1.0, column)
            self._columns[column].append(self._bends[key])
        return self._bends[key]

    # From left to right -------------------------------------------------------------------------

    def _all(self) -> Iterator[Node]:
        return (node for column in self._columns for node in column)

    def _place(self, routes: Routes) -> float:
        """Give every node its `x`, own ports at the edges; return the width of it all."""
        x = 0.0
        for number, column in enumerate(self._columns):
            width = max((node.width for node in column), default=0.0)
            for node in column:
                node.x = x + (width - node.width) / 2
            x += width
            if number < len(routes.channels):
                x = routes.channels[number].place(x)
        x = max(x, text_width(self._model.name, NAME_SIZE) * BOLD + 24)
        for port, node in self._ports.items():
            node.x = 0.0 if isinstance(port, InPort) else x - node.width
        return x

    def _to_the_edges(
        self, source: AnyPort, end: AnyPort, points: Sequence[Point], width: float
    ) -> list[Point]:
        """A route that also passes under the labels of the model's own ports; straight ends."""
        route = list(points)
        if source in self._ports:
            route.insert(0, Point(0.0, route[0].y))
        if end in self._ports:
            route.append(Point(width, route[-1].y))
        return _without_level_points(route)


def _without_level_points(points: Sequence[Point]) -> list[Point]:
    """The same way without the points at which it goes straight on."""
    route = list(points[:1])
    for at, ahead in zip(points[1:], (*points[2:], None), strict=True):
        behind = route[-1]
        is_level = ahead is not None and (
            behind.x == at.x == ahead.x or behind.y == at.y == ahead.y
        )
        if not is_level:
            route.append(at)
    return route


_STATE_BELOW: Final = 13
_INSET: Final = 9
"""From a box's edge to a port's label."""


def coupling_diagram(model: Component) -> str:
    """The model's couplings, at every level, as a picture."""
    canvas = Canvas()
    _draw(canvas, box_of(model), Point(0.0, 0.0), depth=0)
    return diagram_text(canvas, f"Couplings of {model.path}")


def _draw(canvas: Canvas, box: Box, corner: Point, depth: int) -> None:
    """Draw a box, the wires in it, and what is in it."""
    is_atomic = not (box.parts or box.routes)
    css = "atomic" if is_atomic else "inner" if depth % 2 else "coupled"
    path = below_root(box.model.path)
    marks = {"data_model": path}
    canvas.rectangle(Rectangle(*corner, box.width, box.height), css, corner=CORNER, **marks)
    middle, anchor = (box.width / 2, "middle") if is_atomic else (12, "start")
    title = Point(corner.x + middle, corner.y + 21)
    canvas.text(title, box.model.name, "name", anchor, NAME_SIZE)
    for source, end, route in box.routes:
        points = [Point(corner.x + point.x, corner.y + point.y) for point in route]
        words = f"{source.path} \N{RIGHTWARDS ARROW} {end.path}"
        canvas.wire(points, "wire", words, data_port=below_root(source.path))
        canvas.head(points[-1], points[-2], "head")
    _draw_ports(canvas, box, corner, 4 if is_atomic else -4)
    if is_atomic:  # where a page that is alive says what it is in
        below = Point(corner.x + box.width / 2, corner.y + box.height + _STATE_BELOW)
        canvas.text(below, "", "note", "middle", data_state_of=path)
    for node, part in box.parts:
        _draw(canvas, part, Point(corner.x + node.x, corner.y + node.y), depth + 1)


def _draw_ports(canvas: Canvas, box: Box, corner: Point, lower: float) -> None:
    """Name inputs at the left and outputs at the right edge."""
    for names, x, anchor in (
        (box.inputs, corner.x + _INSET, "start"),
        (box.outputs, corner.x + box.width - _INSET, "end"),
    ):
        for name, height in names.items():
            canvas.text(Point(x, corner.y + height + lower), name, "port", anchor, PORT_SIZE)
