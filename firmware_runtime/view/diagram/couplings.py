"""The couplings of a model as SVG: boxes in boxes, ports at their edges, wires between them.

Inputs are at the left of a box, outputs at the right. A wire lights up and names both its ends
under the pointer.
"""

from typing import Final

from firmware_runtime.devs.component import Component
from firmware_runtime.view.diagram.boxes import NAME_SIZE, PORT_SIZE, Box
from firmware_runtime.view.diagram.nesting import box_of
from firmware_runtime.view.diagram.svg import Canvas, Point

_INSET: Final = 9
"""From a box's edge to a port's label."""


def coupling_diagram(model: Component) -> str:
    """The model's couplings, at every level, as a picture."""
    canvas = Canvas()
    _draw(canvas, box_of(model), Point(0.0, 0.0), depth=0)
    return canvas.render(f"Couplings of {model.path}")


def _draw(canvas: Canvas, box: Box, corner: Point, depth: int) -> None:
    if not (box.parts or box.routes):
        _draw_atomic(canvas, box, corner)
        return
    canvas.rectangle(corner, box.width, box.height, "inner" if depth % 2 else "coupled")
    title = Point(corner.x + 12, corner.y + 21)
    canvas.text(title, box.model.name, "name", NAME_SIZE)
    for source, end, route in box.routes:
        points = [Point(corner.x + point.x, corner.y + point.y) for point in route]
        canvas.wire(points, "wire", f"{source.path} \N{RIGHTWARDS ARROW} {end.path}")
        canvas.head(points[-1], points[-2], "head")
    for names, x, anchor in (
        (box.inputs, corner.x + _INSET, "start"),
        (box.outputs, corner.x + box.width - _INSET, "end"),
    ):
        for name, height in names.items():
            canvas.text(Point(x, corner.y + height - 4), name, "port", PORT_SIZE, anchor)
    for node, part in box.parts:
        _draw(canvas, part, Point(corner.x + node.x, corner.y + node.y), depth + 1)


def _draw_atomic(canvas: Canvas, box: Box, corner: Point) -> None:
    canvas.rectangle(corner, box.width, box.height, "atomic")
    title = Point(corner.x + box.width / 2, corner.y + 21)
    canvas.text(title, box.model.name, "name", NAME_SIZE, "middle")
    for names, x, anchor in (
        (box.inputs, corner.x + _INSET, "start"),
        (box.outputs, corner.x + box.width - _INSET, "end"),
    ):
        for name, height in names.items():
            canvas.text(Point(x, corner.y + height + 4), name, "port", PORT_SIZE, anchor)
