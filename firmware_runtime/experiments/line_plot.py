"""A plot of a few curves over time as one SVG file: it stands alone, and in a page.

Lengths are pixels, y grows downwards. Colours are those of the project's pages, for light and dark.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Final
from xml.etree.ElementTree import Element, tostring

from firmware_runtime.statistics.page.markup import element
from firmware_runtime.statistics.page.style import PALETTE

Points = Sequence[tuple[float, float]]

WIDTH, HEIGHT = 720.0, 320.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 16.0, 34.0, 44.0
_MARKS = 6
_MOST_POINTS = 2000
COLOURS: Final = ("blue", "late", "colour1", "colour4", "colour2")
_GREY: Final = ("line", "ink", "quiet")


@dataclass(frozen=True, slots=True)
class Curve:
    """Points in order of time, s; `is_dashed` for a reference."""

    name: str
    points: Points
    is_dashed: bool = False


@dataclass(frozen=True, slots=True)
class LinePlot:
    """Curves on common axes, with a legend above."""

    title: str
    across: str
    up: str
    curves: Sequence[Curve]

    def svg(self) -> Element:
        """The picture."""
        points = [point for curve in self.curves for point in curve.points] or [(0.0, 0.0)]
        x = _Axis(*_ends([at for at, _ in points]), _LEFT, WIDTH - _RIGHT)
        y = _Axis(*_ends([value for _, value in points]), HEIGHT - _BOTTOM, _TOP)
        return element(
            "svg",
            element("title", self.title),
            element("style", _STYLE),
            element("rect", class_="lp-paper", width="100%", height="100%"),
            *_grid(x, y, self.across, self.up),
            *(each for n, curve in enumerate(self.curves) for each in _curve(n, curve, x, y)),
            *_legend(self.curves),
            class_="lp",
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
            width="100%",
            role="img",
            aria_label=self.title,
        )

    def text(self) -> str:
        """The file."""
        return tostring(self.svg(), encoding="unicode") + "\n"


class _Axis:
    """From a value to pixels, with marks at round values."""

    def __init__(self, low: float, high: float, begin: float, end: float) -> None:
        self.low, self.high, self.begin, self.end = low, high, begin, end
        rough = (high - low) / _MARKS
        power = 10.0 ** floor(log10(rough))
        self._step = next(power * each for each in (1, 2, 5, 10) if power * each >= rough * 0.999)

    def pixel(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.begin + share * (self.end - self.begin)

    def marks(self) -> list[float]:
        first, last = ceil(self.low / self._step - 1e-9), floor(self.high / self._step + 1e-9)
        return [number * self._step for number in range(first, last + 1)]


def _ends(values: Sequence[float]) -> tuple[float, float]:
    """The least and greatest, apart."""
    low, high = min(values), max(values)
    room = 0.04 * (high - low) or max(abs(low), 1.0) * 0.5
    return (low - room if low < 0 or low > room else min(low, 0.0)), high + room


def _grid(x: _Axis, y: _Axis, across: str, up: str) -> list[Element]:
    lines = []
    for mark in x.marks():
        at = x.pixel(mark)
        lines.append(element("line", class_="lp-grid", x1=at, x2=at, y1=y.begin, y2=y.end))
        lines.append(_text(at, y.begin + 16, f"{mark:.6g}", "lp-mark", "middle"))
    for mark in y.marks():
        at = y.pixel(mark)
        lines.append(element("line", class_="lp-grid", x1=x.begin, x2=x.end, y1=at, y2=at))
        lines.append(_text(x.begin - 7, at + 4, f"{mark:.6g}", "lp-mark", "end"))
    lines.append(_text((x.begin + x.end) / 2, HEIGHT - 8, across, "lp-mark", "middle"))
    lines.append(_text(4, _TOP - 20, up, "lp-mark", "start"))
    return lines


def _curve(number: int, curve: Curve, x: _Axis, y: _Axis) -> list[Element]:
    every = max(1, -(-len(curve.points) // _MOST_POINTS))
    places = [f"{x.pixel(at):.1f},{y.pixel(value):.1f}" for at, value in curve.points[::every]]
    css = "lp-dashed" if curve.is_dashed else f"lp-{COLOURS[number % len(COLOURS)]}"
    return [element("polyline", element("title", curve.name), class_=css, points=" ".join(places))]


def _legend(curves: Sequence[Curve]) -> list[Element]:
    found, at = [], WIDTH - _RIGHT
    for number, curve in reversed(list(enumerate(curves))):
        at -= 7.0 * len(curve.name) + 12
        css = "lp-dashed" if curve.is_dashed else f"lp-{COLOURS[number % len(COLOURS)]}"
        found.append(element("line", class_=css, x1=at - 22, x2=at - 4, y1=14, y2=14))
        found.append(_text(at, 18, curve.name, "lp-name", "start"))
        at -= 30
    return found


def _text(x: float, y: float, text: str, css: str, anchor: str) -> Element:
    return element("text", text, class_=css, x=x, y=y, text_anchor=anchor)


def _style() -> str:
    sides: list[str] = []
    for side in (0, 1):
        names = (*COLOURS, *_GREY, "paper")
        paint = {name: PALETTE[name][side] for name in names}
        rules = [f".lp-{name} {{ stroke: {paint[name]} }}" for name in COLOURS]
        rules += [
            f".lp-paper {{ fill: {paint['paper']} }}",
            f".lp-grid {{ stroke: {paint['line']} }}",
            f".lp-dashed {{ stroke: {paint['quiet']} }}",
            f".lp-mark {{ fill: {paint['quiet']} }} .lp-name {{ fill: {paint['ink']} }}",
        ]
        sides.append(" ".join(rules))
    shapes = (
        ".lp polyline, .lp line { fill: none; stroke-width: 1.6 } .lp .lp-grid { stroke-width: 1 } "
        ".lp-dashed { stroke-dasharray: 5 4 } "
        '.lp-mark, .lp-name { font: 12px "DejaVu Sans", Verdana, system-ui, sans-serif }'
    )
    return f"{shapes} {sides[0]} @media (prefers-color-scheme: dark) {{ {sides[1]} }}"


_STYLE: Final = _style()
