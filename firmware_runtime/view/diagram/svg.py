"""A canvas that collects shapes and becomes one self-contained SVG, readable on light and dark.

Lengths are pixels, y grows downwards. The canvas grows with what is put on it. Colours are in the
style sheet alone, once for each of the reader's colour schemes.
"""

from collections.abc import Iterable, Sequence
from math import hypot
from typing import Final, NamedTuple
from xml.sax.saxutils import escape, quoteattr

MARGIN: Final = 20
CORNER: Final = 6
"""Radius of a wire's bends."""

BOLD: Final = 1.1
"""How much wider bold letters are."""

_NARROW: Final = frozenset("iljtfrI.,:;!'|()[] ")
_WIDE: Final = frozenset("mwMW@")

_STYLE: Final = """
  text { font-family: "DejaVu Sans", Verdana, system-ui, sans-serif; fill: #1f2328 }
  .paper { fill: #ffffff }
  .title { font-size: 16px; font-weight: bold }
  .name { font-size: 13px; font-weight: bold }
  .port { font-size: 11px }
  .note { font-size: 11px; fill: #59636e }
  .coupled { fill: #f6f8fa; stroke: #8c959f; stroke-width: 1.2 }
  .inner { fill: #eaeef2; stroke: #8c959f; stroke-width: 1.2 }
  .atomic, .state { fill: #ffffff; stroke: #424a53; stroke-width: 1.4 }
  .wire, .external, .internal, .start { fill: none; stroke-width: 1.4 }
  .start { stroke: #424a53 }
  .start-head { fill: #424a53 }
  .wire, .external { stroke: #0550ae }
  .internal { stroke: #953800; stroke-dasharray: 6 4 }
  .wire:hover { stroke-width: 3.5 }
  .head, .external-head { fill: #0550ae }
  .internal-head { fill: #953800 }
  .external-label { font-size: 11px; fill: #0550ae }
  .internal-label { font-size: 11px; fill: #953800 }
  .halo { stroke: #ffffff; stroke-width: 4; stroke-linejoin: round; paint-order: stroke }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3 }
    .paper { fill: #0d1117 }
    .note { fill: #9198a1 }
    .coupled { fill: #151b23; stroke: #656c76 }
    .inner { fill: #212830; stroke: #656c76 }
    .atomic, .state { fill: #0d1117; stroke: #b7bdc8 }
    .start { stroke: #b7bdc8 }
    .start-head { fill: #b7bdc8 }
    .wire, .external { stroke: #79c0ff }
    .internal { stroke: #ffa657 }
    .head, .external-head, .external-label { fill: #79c0ff }
    .internal-head, .internal-label { fill: #ffa657 }
    .halo { stroke: #0d1117 }
  }
"""


class Point(NamedTuple):
    """A place on the canvas."""

    x: float
    y: float


def text_width(text: str, size: float) -> float:
    """An estimate, on the safe side, of how wide a text is at a font size."""
    return size * sum(
        0.42 if letter in _NARROW else 0.98 if letter in _WIDE else 0.66 for letter in text
    )


class Canvas:
    """Collects shapes; each has a class of the style sheet."""

    def __init__(self) -> None:
        self._shapes: list[str] = []
        self._points: list[Point] = []

    def rectangle(self, corner: Point, width: float, height: float, css: str) -> None:
        """A box with rounded corners, from its upper left one."""
        self._cover(corner, Point(corner.x + width, corner.y + height))
        x, y = pixels(corner.x), pixels(corner.y)
        size = f'width="{pixels(width)}" height="{pixels(height)}"'
        self._shapes.append(f'<rect class="{css}" x="{x}" y="{y}" {size} rx="{CORNER}"/>')

    def circle(self, centre: Point, radius: float, css: str) -> None:
        """A circle."""
        self._cover(
            Point(centre.x - radius, centre.y - radius), Point(centre.x + radius, centre.y + radius)
        )
        place = f'cx="{pixels(centre.x)}" cy="{pixels(centre.y)}" r="{pixels(radius)}"'
        self._shapes.append(f'<circle class="{css}" {place}/>')

    def text(self, at: Point, text: str, css: str, size: float, anchor: str = "start") -> None:
        """A line of text; `at` is on its base line, at its start, middle or end."""
        width = text_width(text, size)
        left = at.x - width * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        self._cover(Point(left, at.y - size), Point(left + width, at.y + size / 3))
        place = f'x="{pixels(at.x)}" y="{pixels(at.y)}" text-anchor="{anchor}"'
        self._shapes.append(f'<text class="{css}" {place}>{escape(text)}</text>')

    def wire(self, points: Sequence[Point], css: str, tooltip: str) -> None:
        """A line of straight pieces with rounded bends."""
        bends = [
            _bend(before, at, after)
            for before, at, after in zip(points, points[1:], points[2:], strict=False)
        ]
        path = " ".join((f"M{point(points[0])}", *bends, f"L{point(points[-1])}"))
        self._path(points, path, css, tooltip)

    def curve(self, points: Sequence[Point], css: str) -> None:
        """A Bezier curve, of three points quadratic, of four cubic."""
        command = "Q" if len(points) == 3 else "C"
        bends = " ".join(map(point, points[1:]))
        self._path(points, f"M{point(points[0])} {command}{bends}", css, "")

    def head(self, tip: Point, behind: Point, css: str) -> None:
        """An arrow's head that points from `behind` to `tip`."""
        length = hypot(tip.x - behind.x, tip.y - behind.y) or 1.0
        dx, dy = (tip.x - behind.x) / length, (tip.y - behind.y) / length
        left = Point(tip.x - 9 * dx + 4 * dy, tip.y - 9 * dy - 4 * dx)
        right = Point(tip.x - 9 * dx - 4 * dy, tip.y - 9 * dy + 4 * dx)
        corners = " ".join(map(point, (tip, left, right)))
        self._shapes.append(f'<polygon class="{css}" points="{corners}"/>')

    def render(self, title: str) -> str:
        """The whole picture, as large as what is on it and a margin."""
        left = min(point.x for point in self._points) - MARGIN
        top = min(point.y for point in self._points) - MARGIN
        width = max(point.x for point in self._points) + MARGIN - left
        height = max(point.y for point in self._points) + MARGIN - top
        view = f"{pixels(left)} {pixels(top)} {pixels(width)} {pixels(height)}"
        place = f'x="{pixels(left)}" y="{pixels(top)}"'
        size = f'width="{pixels(width)}" height="{pixels(height)}"'
        space = 'xmlns="http://www.w3.org/2000/svg"'
        return "\n".join(
            (
                f'<svg {space} viewBox="{view}" {size} role="img" aria-label={quoteattr(title)}>',
                f"<title>{escape(title)}</title>",
                f"<style>{_STYLE}</style>",
                f'<rect class="paper" {place} {size}/>',
                *self._shapes,
                "</svg>\n",
            )
        )

    # ---------------------------------------------------------------------------------------------

    def _path(self, points: Iterable[Point], path: str, css: str, tooltip: str) -> None:
        self._cover(*points)
        title = f"<title>{escape(tooltip)}</title>" if tooltip else ""
        self._shapes.append(f'<path class="{css}" d="{path}">{title}</path>')

    def _cover(self, *points: Point) -> None:
        self._points.extend(points)


def _bend(before: Point, at: Point, after: Point) -> str:
    """The way into a bend and round it."""
    start, end = _towards(at, before), _towards(at, after)
    return f"L{point(start)} Q{point(at)} {point(end)}"


def _towards(start: Point, end: Point) -> Point:
    """The point a bend's radius away from `start`, or half way if that is nearer."""
    length = hypot(end.x - start.x, end.y - start.y) or 1.0
    part = min(CORNER / length, 0.5)
    return Point(start.x + part * (end.x - start.x), start.y + part * (end.y - start.y))


def pixels(number: float) -> str:
    """A length with one decimal at most."""
    return f"{number:.1f}".removesuffix(".0")


def point(at: tuple[float, float]) -> str:
    """A point in SVG's path language."""
    return f"{pixels(at[0])},{pixels(at[1])}"
