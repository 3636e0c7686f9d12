"""The state graph of a state diagram as SVG, in the manner of GGAD.

Circles hold a state's name and duration, on a ring in order of the table. Solid arrows are external
transitions, dashed ones internal. A dot leads to the initial state.
"""

from collections.abc import Sequence
from math import dist
from typing import Final, NamedTuple

from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow
from firmware_runtime.view.diagram.canvas import BOLD, Canvas, Point, Rectangle, text_width
from firmware_runtime.view.diagram.curves import (
    GAP,
    beside,
    between,
    holds,
    loop,
    outward,
    overlap,
    point_on,
    ring,
    samples,
)
from firmware_runtime.view.diagram.diagram_look import (
    NAME_SIZE,
    arrow_labels,
    diagram_text,
    duration_text,
    wrap,
)

LABEL_SIZE: Final = 11
LINE: Final = 15
"""From one base line to the next."""

_LETTERS: Final = 26
_BULGES: Final = (-0.22, 0.22, -0.1, 0.1, -0.36, 0.36, -0.5, 0.5)
_PARTS: Final = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74)


class Drawn(NamedTuple):
    """Arrows of one kind between the same two states, drawn as one curve."""

    kind: str
    """`external` or `internal`."""
    curve: list[Point]
    points: list[Point]
    """Points all along the curve."""
    label: list[str]


def curves(model: StateDiagram, centres: dict[str, Point], radius: float) -> list[Drawn]:
    """A curve for all arrows of one kind from one state to another, short ones first."""
    groups: dict[tuple[str, str, str], list[Arrow]] = {}
    for state in model.states:
        for arrow in state.arrows:
            kind = "external" if arrow.is_external else "internal"
            groups.setdefault((state.name, arrow.to, kind), []).append(arrow)
    drawn: list[Drawn] = []
    # Short arrows have one way to go; the long ones then find their ways between them.
    for key in sorted(groups, key=lambda key: round(dist(centres[key[0]], centres[key[1]]), 3)):
        start, end, kind = key
        others = [centre for name, centre in centres.items() if name not in {start, end}]
        ways = _ways(centres[start], centres[end], radius)
        curve = min(ways, key=lambda way: _hidden(samples(way), others, radius, drawn))
        label = arrow_labels(groups[key], _LETTERS)
        drawn.append(Drawn(kind, curve, samples(curve), label))
    return drawn


def place_label(each: Drawn, drawn: Sequence[Drawn], taken: Sequence[Rectangle]) -> Rectangle:
    """Find the place of a curve's label, beside the curve."""
    width = max(text_width(line, LABEL_SIZE) for line in each.label)
    size = Point(width, len(each.label) * LINE)

    def hidden(place: Rectangle) -> float:
        crossed = sum(holds(place, point) for other in drawn for point in other.points)
        return sum(overlap(place, other) for other in taken) + 60 * crossed

    places = (beside(each.curve, part, side, size) for part in _PARTS for side in (1, -1))
    return min(places, key=hidden)


def _ways(start: Point, end: Point, radius: float) -> list[list[Point]]:
    """The ways an arrow can go, best looking first."""
    if start == end:
        return [loop(start, radius, radius + reach) for reach in (60, 95)]
    is_short = dist(start, end) < 2 * radius + 1.2 * GAP
    bulges = (0.36, 0.72) if is_short else _BULGES
    return [between(start, end, radius, bulge) for bulge in bulges]


def _hidden(
    points: Sequence[Point], others: Sequence[Point], radius: float, drawn: Sequence[Drawn]
) -> int:
    """Count how much of a way lies in other states, or upon arrows drawn already."""
    in_states = sum(dist(point, centre) < radius + 8 for point in points for centre in others)
    on_arrows = sum(
        dist(point, other) < 9
        for each in drawn
        for other in each.points[6:-6:2]  # where arrows begin and end they may well meet
        for point in points
    )
    return 10 * in_states + on_arrows


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
        _draw_name(canvas, centre, names[name], duration_text(model.durations[name]))
    _draw_start(canvas, next(iter(centres.values())), radius)
    taken = [_around(centre, radius) for centre in centres.values()]
    for each in drawn:
        if each.label:
            taken.append(place_label(each, drawn, taken))
            _draw_label(canvas, each, taken[-1])
    _draw_frame(canvas, model.path, taken)
    return diagram_text(canvas, f"States of {model.path}")


def _radius(lines: Sequence[str]) -> float:
    """Radius of the circle that holds a name and a duration below it."""
    width = max(text_width(line, NAME_SIZE) for line in lines) * BOLD / 2
    height = (len(lines) + 1) * LINE / 2
    return float(max((width**2 + (height - LINE) ** 2) ** 0.5, (height**2 + 18**2) ** 0.5)) + 8


def _draw_curve(canvas: Canvas, each: Drawn) -> None:
    canvas.curve(each.curve, each.kind)
    canvas.head(each.curve[-1], point_on(each.curve, 0.95), f"{each.kind}-head")


def _draw_name(canvas: Canvas, centre: Point, lines: Sequence[str], duration: str) -> None:
    y = centre.y - len(lines) * LINE / 2 + NAME_SIZE / 3
    for line in lines:
        canvas.text(Point(centre.x, y), line, "name", "middle", NAME_SIZE)
        y += LINE
    canvas.text(Point(centre.x, y), duration, "note", "middle", LABEL_SIZE)


def _draw_start(canvas: Canvas, centre: Point, radius: float) -> None:
    out = outward(centre)
    tip = Point(centre.x + radius * out.x, centre.y + radius * out.y)
    dot = Point(tip.x + 34 * out.x, tip.y + 34 * out.y)
    canvas.wire([dot, tip], "start")
    canvas.head(tip, dot, "start-head")
    canvas.circle(dot, 5, "start-head")


def _draw_label(canvas: Canvas, each: Drawn, place: Rectangle) -> None:
    for number, line in enumerate(each.label):
        at = Point((place.left + place.right) / 2, place.top + LINE * (number + 0.78))
        canvas.text(at, line, f"{each.kind}-label halo", "middle", LABEL_SIZE)


def _draw_frame(canvas: Canvas, title: str, taken: Sequence[Rectangle]) -> None:
    """The title above and the legend below everything else."""
    left = min(each.left for each in taken)
    top = min(each.top for each in taken) - 64
    y = max(each.bottom for each in taken) + 46
    canvas.text(Point(left, top), title, "title", size=16)
    for kind, label, meaning in LEGEND:
        canvas.wire([Point(left, y - 4), Point(left + 46, y - 4)], kind)
        canvas.head(Point(left + 52, y - 4), Point(left, y - 4), f"{kind}-head")
        canvas.text(Point(left + 62, y), label, f"{kind}-label", size=LABEL_SIZE)
        canvas.text(Point(left + 142, y), meaning, "note", size=LABEL_SIZE)
        y += 20


def _around(centre: Point, radius: float) -> Rectangle:
    return Rectangle(centre.x - radius, centre.y - radius, 2 * radius, 2 * radius)
