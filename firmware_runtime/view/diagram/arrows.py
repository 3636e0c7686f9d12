"""The arrows of a state graph: which are drawn as one, which way they go, where their labels stand.

Each arrow, and then each label, takes of several possible ways the one that hides least of what is
drawn already.
"""

from collections.abc import Sequence
from math import dist
from typing import Final, NamedTuple

from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow
from firmware_runtime.view.diagram.curves import (
    GAP,
    Rectangle,
    beside,
    between,
    loop,
    samples,
)
from firmware_runtime.view.diagram.diagram_words import say_arrows
from firmware_runtime.view.diagram.svg import Point, text_width

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
        label = say_arrows(groups[key], _LETTERS)
        drawn.append(Drawn(kind, curve, samples(curve), label))
    return drawn


def place_label(each: Drawn, drawn: Sequence[Drawn], taken: Sequence[Rectangle]) -> Rectangle:
    """Where a curve's label stands, beside the curve."""
    width = max(text_width(line, LABEL_SIZE) for line in each.label)
    size = Point(width, len(each.label) * LINE)

    def hidden(place: Rectangle) -> float:
        crossed = sum(place.holds(point) for other in drawn for point in other.points)
        return sum(place.overlap(other) for other in taken) + 60 * crossed

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
    """How much of a way lies in other states, or upon arrows drawn already."""
    in_states = sum(dist(point, centre) < radius + 8 for point in points for centre in others)
    on_arrows = sum(
        dist(point, other) < 9
        for each in drawn
        for other in each.points[6:-6:2]  # where arrows begin and end they may well meet
        for point in points
    )
    return 10 * in_states + on_arrows
