"""The paper the picture of a run is drawn on: shapes that become one SVG, for light and dark.

Lengths are pixels, y grows downwards. Colours are in the style sheet alone, once for each of the
reader's colour schemes; a programme that knows no scheme shows the light one.
"""

import math
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple
from xml.sax.saxutils import escape, quoteattr

from firmware_runtime.view.diagram.svg import pixels, point
from sim_doubles.worlds.arena_geometry import Point

__all__ = ["HUES", "Axis", "Box", "Page", "point", "text_width"]

HUES: Final = 7
"""How many colours there are for states, classes `hue0` and on; `hue-brief` is for the rest."""

_COLOURS: Final = {
    ".paper": ("fill", "#ffffff", "#0d1117"),
    "text": ("fill", "#1f2328", "#e6edf3"),
    ".note": ("fill", "#59636e", "#9198a1"),
    ".grid": ("stroke", "#e7eaee", "#20262e"),
    ".frame": ("stroke", "#8c959f", "#656c76"),
    ".obstacle": ("fill", "#afb8c1", "#484f58"),
    ".wall": ("stroke", "#6e7781", "#8b949e"),
    ".target": ("fill", "#cf222e", "#f85149"),
    ".goal": ("stroke", "#cf222e", "#f85149"),
    ".goal-zone": ("fill", "#cf222e", "#f85149"),
    ".sweep": ("fill", "#5b84b1", "#79a6d8"),
    ".radar": ("fill", "#0a7ea4", "#39c5cf"),
    ".radar-edge": ("stroke", "#0a7ea4", "#39c5cf"),
    ".body": ("fill", "#d4870b", "#e3b341"),
    ".body-edge": ("stroke", "#d4870b", "#e3b341"),
    ".vehicle": ("stroke", "#1f2328", "#e6edf3"),
    ".solid": ("fill", "#ffffff", "#0d1117"),
    ".nose": ("fill", "#1f2328", "#e6edf3"),
    ".line": ("stroke", "#1f2328", "#e6edf3"),
    ".on-hue": ("fill", "#ffffff", "#0d1117"),
    ".hue0": ("--hue", "#3b6fd4", "#6ea8ff"),
    ".hue1": ("--hue", "#8250df", "#b392f0"),
    ".hue2": ("--hue", "#2a8a52", "#56d383"),
    ".hue3": ("--hue", "#b5487f", "#f29bc1"),
    ".hue4": ("--hue", "#7d6236", "#d1b27a"),
    ".hue5": ("--hue", "#5d8223", "#a5d25c"),
    ".hue6": ("--hue", "#6a737d", "#a2abb5"),
    ".hue-brief": ("--hue", "#1f2328", "#e6edf3"),
}
"""What each class colours: property, light, dark."""

_SHAPES: Final = """
  text { font: 12px "DejaVu Sans", Verdana, system-ui, sans-serif }
  .title { font-size: 18px; font-weight: bold }
  .small { font-size: 11px }
  .grid, .frame, .wall, .goal, .vehicle, .line, .path, .edge { fill: none }
  .frame { stroke-width: 1 }
  .wall { stroke-width: 4; stroke-linecap: round }
  .low { opacity: 0.55 }
  .goal { stroke-width: 1.2; stroke-dasharray: 5 4 }
  .goal-zone { opacity: 0.08 }
  .sweep { opacity: 0.13 }
  .beam { opacity: 0.30 }
  .edge { stroke-width: 2.6; stroke-linecap: round }
  .path { stroke-width: 3.2; stroke-linecap: round; stroke-linejoin: round }
  .vehicle { stroke-width: 1.6 }
  .ghost { opacity: 0.40 }
  .line { stroke-width: 1.6; stroke-linejoin: round }
"""


class Box(NamedTuple):
    """A rectangle on the page."""

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


class Axis(NamedTuple):
    """Values from `low` to `high` along the pixels from `begin` to `end`."""

    low: float
    high: float
    begin: float
    end: float

    def pixel(self, value: float) -> float:
        """Where a value is."""
        return self.begin + (value - self.low) / (self.high - self.low) * (self.end - self.begin)

    def length(self, span: float) -> float:
        """How many pixels a span takes."""
        return abs(self.pixel(span) - self.pixel(0.0))

    def ticks(self, least_apart: float) -> list[float]:
        """Round values, 1, 2 or 5 times a power of ten apart, so many pixels or more."""
        least = least_apart / self.length(1.0)
        power = 10.0 ** math.floor(math.log10(least))
        step = next(power * n for n in (1, 2, 5, 10) if power * n >= least * 0.999)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [n * step for n in range(first, last + 1)]


class Page:
    """Collects shapes; each has classes of the style sheet."""

    def __init__(self, width: float) -> None:
        self._width = width
        self._shapes: list[str] = []
        self._clips = 0

    def text(self, at: Point, text: str, css: str = "", anchor: str = "start") -> None:
        """A line of text; `at` is on its base line, at its start, middle or end."""
        place = f'x="{pixels(at[0])}" y="{pixels(at[1])}" text-anchor="{anchor}"'
        self._shapes.append(f'<text class="{css}" {place}>{escape(text)}</text>')

    def text_upwards(self, at: Point, text: str, css: str) -> None:
        """A line of text that runs upwards, centred on a point."""
        turned = f'transform="translate({point(at)}) rotate(-90)" text-anchor="middle"'
        self._shapes.append(f'<text class="{css}" {turned}>{escape(text)}</text>')

    def line(self, start: Point, end: Point, css: str) -> None:
        """A straight line."""
        self.path(f"M{point(start)} L{point(end)}", css)

    def polyline(self, points: Iterable[Point], css: str) -> None:
        """Straight lines from point to point."""
        self.path("M" + " L".join(map(point, points)), css)

    def polygon(self, points: Iterable[Point], css: str) -> None:
        """A filled figure."""
        self.path("M" + " L".join(map(point, points)) + " Z", css)

    def path(self, description: str, css: str) -> None:
        """Any figure, in SVG's path language."""
        self._shapes.append(f'<path class="{css}" d="{description}"/>')

    def circle(self, centre: Point, radius: float, css: str) -> None:
        """A circle."""
        place = f'cx="{pixels(centre[0])}" cy="{pixels(centre[1])}" r="{pixels(radius)}"'
        self._shapes.append(f'<circle class="{css}" {place}/>')

    def rectangle(self, box: Box, css: str, tooltip: str = "") -> None:
        """A box."""
        title = f"<title>{escape(tooltip)}</title>" if tooltip else ""
        self._shapes.append(f'<rect class="{css}" {_place(box)}>{title}</rect>')

    def begin_clip(self, box: Box) -> None:
        """From here on nothing is drawn outside the box, until `end_clip`."""
        self._clips += 1
        name = f"clip{self._clips}"
        self._shapes.append(f'<clipPath id="{name}"><rect {_place(box)}/></clipPath>')
        self._shapes.append(f'<g clip-path="url(#{name})">')

    def end_clip(self) -> None:
        """Draw anywhere again."""
        self._shapes.append("</g>")

    def render(self, height: float, title: str) -> str:
        """The whole picture."""
        size = f'width="{pixels(self._width)}" height="{pixels(height)}"'
        view = f"0 0 {pixels(self._width)} {pixels(height)}"
        label = f'role="img" aria-label={quoteattr(title)}'
        return "\n".join(
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view}" {size} {label}>',
                f"<title>{escape(title)}</title>",
                f"<style>{_style()}</style>",
                f'<rect class="paper" {size}/>',
                *self._shapes,
                "</svg>\n",
            )
        )


def text_width(text: str) -> float:
    """An estimate, on the safe side, of how wide a text of the common size is."""
    return 7.6 * len(text)


def _style() -> str:
    light = "\n".join(_rules(scheme=0))
    dark = "\n".join(_rules(scheme=1))
    return f"{_SHAPES}{light}\n  @media (prefers-color-scheme: dark) {{\n{dark}\n  }}\n"


def _rules(scheme: int) -> Iterator[str]:
    """The colours as rules; a hue fills, or draws what is a path."""
    for css, (what, *colours) in _COLOURS.items():
        colour = colours[scheme]
        if what == "--hue":
            yield f"  {css} {{ fill: {colour} }}"
            yield f"  .path{css} {{ fill: none; stroke: {colour} }}"
        else:
            yield f"  {css} {{ {what}: {colour} }}"


def _place(box: Box) -> str:
    place = f'x="{pixels(box.left)}" y="{pixels(box.top)}"'
    return f'{place} width="{pixels(box.width)}" height="{pixels(box.height)}"'
