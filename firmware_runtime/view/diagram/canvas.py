"""A canvas that collects shapes and becomes one SVG, readable on light and dark.

Lengths are pixels, y grows downwards. Colours are in a style sheet alone, once for each of the
reader's colour schemes; a shape has classes of it.
"""

import re
from collections.abc import Iterable, Sequence
from math import hypot
from typing import Final, NamedTuple
from xml.etree.ElementTree import Element, tostring

CORNER: Final = 6
"""Radius of a wire's bends."""
BOLD: Final = 1.1
"""Width of bold letters by that of others."""
FONT: Final = '"DejaVu Sans", Verdana, system-ui, sans-serif'
_NARROW: Final = frozenset("iljtfrI.,:;!'|()[] ")
_WIDE: Final = frozenset("mwMW@")
_UNSPEAKABLE: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff]")
"""Characters that XML or UTF-8 cannot carry."""


class Point(NamedTuple):
    """A place on the canvas."""

    x: float
    y: float


class Rectangle(NamedTuple):
    """A rectangle on the canvas."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Its right edge."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Its lower edge."""
        return self.top + self.height


Place = tuple[float, float]


class Canvas:
    """Collects shapes; each has classes of the style sheet."""

    def __init__(self) -> None:
        self._shapes: list[Element] = []
        self._points: list[Place] = []

    def rectangle(
        self,
        box: Rectangle,
        css: str,
        tooltip: str = "",
        corner: float | None = None,
        **marks: str,
    ) -> None:
        """A box, its corners rounded by a radius if one is given; `marks` are more attributes."""
        self.put("rect", css, tooltip, **_sides(box), rx=corner, **marks)
        self._points += (box.left, box.top), (box.right, box.bottom)

    def circle(self, centre: Place, radius: float, css: str) -> None:
        """A circle."""
        x, y = centre
        self.put("circle", css, cx=x, cy=y, r=radius)
        self._points += (x - radius, y - radius), (x + radius, y + radius)

    def text(
        self,
        at: Place,
        text: str,
        css: str = "",
        anchor: str = "start",
        size: float = 12.0,
        **marks: str,
    ) -> None:
        """A line of text; `at` is on its base line, at its start, middle or end."""
        width = text_width(text, size)
        left = at[0] - width * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        place = {"x": at[0], "y": at[1]}
        self._shapes.append(element("text", text, class_=css, text_anchor=anchor, **place, **marks))
        self._points += (left, at[1] - size), (left + width, at[1] + size / 3)

    def polygon(self, points: Iterable[Place], css: str) -> None:
        """A filled figure."""
        self.put("path", css, d="M" + " L".join(map(point, points)) + " Z")

    def wire(self, points: Sequence[Point], css: str, tooltip: str = "", **marks: str) -> None:
        """A line of straight pieces with rounded bends."""
        bends = [_bend(*each) for each in zip(points, points[1:], points[2:], strict=False)]
        path = " ".join((f"M{point(points[0])}", *bends, f"L{point(points[-1])}"))
        self.put("path", css, tooltip, d=path, **marks)
        self._points += points

    def curve(self, points: Sequence[Point], css: str) -> None:
        """A Bezier curve, of three points quadratic, of four cubic."""
        command = "Q" if len(points) == 3 else "C"
        bends = " ".join(map(point, points[1:]))
        self.put("path", css, d=f"M{point(points[0])} {command}{bends}")
        self._points += points

    def head(self, tip: Point, behind: Point, css: str) -> None:
        """An arrow's head that points from `behind` to `tip`."""
        length = hypot(tip.x - behind.x, tip.y - behind.y) or 1.0
        dx, dy = (tip.x - behind.x) / length, (tip.y - behind.y) / length
        left = Point(tip.x - 9 * dx + 4 * dy, tip.y - 9 * dy - 4 * dx)
        right = Point(tip.x - 9 * dx - 4 * dy, tip.y - 9 * dy + 4 * dx)
        self.polygon((tip, left, right), css)

    def box(self, margin: float) -> Rectangle:
        """The box around all that is drawn, and a margin."""
        xs, ys = zip(*self._points, strict=True)
        left, top = min(xs) - margin, min(ys) - margin
        return Rectangle(left, top, max(xs) + margin - left, max(ys) + margin - top)

    def svg(self, box: Rectangle, title: str, style: str) -> str:
        """The text of an SVG file."""
        svg = element(
            "svg",
            element("title", title),
            element("style", style),
            element("rect", class_="paper", **_sides(box)),
            *self._shapes,
            xmlns="http://www.w3.org/2000/svg",
            viewBox=" ".join(f"{each:.1f}" for each in box),
            role="img",
            aria_label=title,
            width=box.width,
            height=box.height,
        )
        return tostring(svg, encoding="unicode").rstrip("\n") + "\n"

    def put(self, tag: str, css: str, tooltip: str = "", **place: str | float | None) -> None:
        """Any element of SVG, with the words that stand under the pointer."""
        title = element("title", tooltip) if tooltip else None
        self._shapes.append(element(tag, title, class_=css, **place))


def element(tag: str, *children: Element | str | None, **attributes: str | float | None) -> Element:
    """One element: `class_` becomes `class`, `text_anchor` becomes `text-anchor`.

    Its text is the last child that is one. Children and attributes that are None are left out.
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            made.set(name.rstrip("_").replace("_", "-"), _clean(_text(value)))
    for child in children:
        if isinstance(child, str):
            made.text = _clean(child)
        elif child is not None:
            made.append(child)
    made.tail = "\n"
    return made


def _text(value: str | float) -> str:
    """A number with two decimals at most: a hundredth of a pixel is never seen."""
    return value if isinstance(value, str) else f"{value:.2f}".rstrip("0").rstrip(".")


def _clean(text: str) -> str:
    return _UNSPEAKABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def text_width(text: str, size: float = 12.0) -> float:
    """An estimate, on the safe side, of how wide a text is at a font size."""
    return size * sum(
        0.42 if letter in _NARROW else 0.98 if letter in _WIDE else 0.66 for letter in text
    )


def style_sheet(shapes: str, colours: Sequence[tuple[str, str, str, str]]) -> str:
    """A style sheet: rules for shapes, then colours by selector: property, light, dark."""
    light, dark = (
        "\n".join(f"  {css} {{ {what}: {pair[side]} }}" for css, what, *pair in colours)
        for side in (0, 1)
    )
    return f"{shapes}{light}\n  @media (prefers-color-scheme: dark) {{\n{dark}\n  }}\n"


def point(at: Place) -> str:
    """A point in SVG's path language, with one decimal at most."""
    return ",".join(f"{number:.1f}".removesuffix(".0") for number in at)


def _sides(box: Rectangle) -> dict[str, float]:
    return {"x": box.left, "y": box.top, "width": box.width, "height": box.height}


def _bend(before: Point, at: Point, after: Point) -> str:
    """The way into a bend and round it."""
    start, end = (_towards(at, each) for each in (before, after))
    return f"L{point(start)} Q{point(at)} {point(end)}"


def _towards(start: Point, end: Point) -> Point:
    """The point a bend's radius away from `start`, or half way if that is nearer."""
    length = hypot(end.x - start.x, end.y - start.y) or 1.0
    part = min(CORNER / length, 0.5)
    return Point(start.x + part * (end.x - start.x), start.y + part * (end.y - start.y))
