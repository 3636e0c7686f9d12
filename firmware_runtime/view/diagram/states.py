"""The state graph of a state diagram as SVG, in the manner of GGAD.

Circles hold a state's name and duration, on a ring in order of the table. Solid arrows are external
transitions, dashed ones internal. A dot leads to the initial state.
"""

from collections.abc import Sequence
from typing import Final

from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.view.diagram.arrows import LABEL_SIZE, LINE, Drawn, curves, place_label
from firmware_runtime.view.diagram.curves import Rectangle, outward, point_on, ring
from firmware_runtime.view.diagram.diagram_words import say_duration, wrap
from firmware_runtime.view.diagram.svg import BOLD, Canvas, Point, text_width

NAME_SIZE: Final = 13
NAME_LETTERS: Final = 13

LEGEND: Final = (
    ("external", "port?value", "taken on an input"),
    ("internal", "port!value", "taken when the duration is over, after sending"),
)


def state_graph(model: StateDiagram) -> str:
    """The model's table as a picture."""
    canvas = Canvas()
    names = {state.name: wrap(state.name, NAME_LETTERS) for state in model.states}
    radius = max(_radius(lines) for lines in names.values())
    centres = dict(zip(names, ring(len(names), radius), strict=True))
    drawn = curves(model, centres, radius)
    for each in drawn:
        _draw_curve(canvas, each)
    for name, centre in centres.items():
        canvas.circle(centre, radius, "state")
        _draw_name(canvas, centre, names[name], say_duration(model.durations[name]))
    _draw_start(canvas, next(iter(centres.values())), radius)
    taken = [_around(centre, radius) for centre in centres.values()]
    for each in drawn:
        if each.label:
            taken.append(place_label(each, drawn, taken))
            _draw_label(canvas, each, taken[-1])
    _draw_frame(canvas, model.path, taken)
    return canvas.render(f"States of {model.path}")


def _radius(lines: Sequence[str]) -> float:
    """Of the circle that holds a name and a duration below it."""
    width = max(text_width(line, NAME_SIZE) for line in lines) * BOLD / 2
    height = (len(lines) + 1) * LINE / 2
    return float(max((width**2 + (height - LINE) ** 2) ** 0.5, (height**2 + 18**2) ** 0.5)) + 8


def _draw_curve(canvas: Canvas, each: Drawn) -> None:
    canvas.curve(each.curve, each.kind)
    canvas.head(each.curve[-1], point_on(each.curve, 0.95), f"{each.kind}-head")


def _draw_name(canvas: Canvas, centre: Point, lines: Sequence[str], duration: str) -> None:
    y = centre.y - len(lines) * LINE / 2 + NAME_SIZE / 3
    for line in lines:
        canvas.text(Point(centre.x, y), line, "name", NAME_SIZE, "middle")
        y += LINE
    canvas.text(Point(centre.x, y), duration, "note", LABEL_SIZE, "middle")


def _draw_start(canvas: Canvas, centre: Point, radius: float) -> None:
    out = outward(centre)
    tip = Point(centre.x + radius * out.x, centre.y + radius * out.y)
    dot = Point(tip.x + 34 * out.x, tip.y + 34 * out.y)
    canvas.wire([dot, tip], "start", "")
    canvas.head(tip, dot, "start-head")
    canvas.circle(dot, 5, "start-head")


def _draw_label(canvas: Canvas, each: Drawn, place: Rectangle) -> None:
    for number, line in enumerate(each.label):
        at = Point((place.left + place.right) / 2, place.top + LINE * (number + 0.78))
        canvas.text(at, line, f"{each.kind}-label halo", LABEL_SIZE, "middle")


def _draw_frame(canvas: Canvas, title: str, taken: Sequence[Rectangle]) -> None:
    """The title above and the legend below everything else."""
    left = min(each.left for each in taken)
    top = min(each.top for each in taken) - 64
    y = max(each.bottom for each in taken) + 46
    canvas.text(Point(left, top), title, "title", 16)
    for kind, label, meaning in LEGEND:
        canvas.wire([Point(left, y - 4), Point(left + 46, y - 4)], kind, "")
        canvas.head(Point(left + 52, y - 4), Point(left, y - 4), f"{kind}-head")
        canvas.text(Point(left + 62, y), label, f"{kind}-label", LABEL_SIZE)
        canvas.text(Point(left + 142, y), meaning, "note", LABEL_SIZE)
        y += 20


def _around(centre: Point, radius: float) -> Rectangle:
    return Rectangle(centre.x - radius, centre.y - radius, centre.x + radius, centre.y + radius)
