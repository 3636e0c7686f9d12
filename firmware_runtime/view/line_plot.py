"""A plot of a few curves over time as one SVG file: it stands alone, and in a page.

Lengths are pixels, y grows downwards. Colours are those of the project's pages, for light and dark.
"""

from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from firmware_runtime.view.canvas import (
    FONT,
    Canvas,
    Rectangle,
    file_text,
    point,
    style_sheet,
    text_width,
)
from firmware_runtime.view.markup import element
from firmware_runtime.view.scales import Axis
from firmware_runtime.view.style import PALETTE

Points: TypeAlias = Sequence[tuple[float, float]]
Ends: TypeAlias = tuple[float, float]

WIDTH, HEIGHT = 720.0, 320.0
HALF_WIDTH, HALF_HEIGHT = 460.0, 250.0
"""Size of a plot beside another one."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 16.0, 34.0, 44.0
_BETWEEN, _ROW = 30.0, 18.0
"""Sizes in a legend: room for a line and about it, and from one row to the next."""
_LABEL_AT = 4.0
_MOST_MARKS, _LEAST_APART = 6, 40.0
_MOST_POINTS = 2000
_LARGEST = 1.35
"""A page shows a plot so many times its own size at most."""
_LINE: Final = 1.6
_DOT: Final = 1.8
COLOURS: Final = ("blue", "late", "colour1", "colour4", "colour2")
_STYLE: Final = style_sheet(
    f"""
  .lp-line {{ fill: none }} .lp-grid {{ stroke-width: 1 }} .lp-curve {{ stroke-width: {_LINE} }}
  .lp-dashed {{ stroke-dasharray: 5 4 }} .lp-span {{ fill-opacity: .18 }}
  .lp-dot {{ fill-opacity: .5; stroke: none }}
  .lp-mark, .lp-name {{ font: 12px {FONT} }}
""",
    (
        *((f".lp-{name}", "stroke", *PALETTE[name]) for name in COLOURS),
        *((f".lp-dot.lp-{name}", "fill", *PALETTE[name]) for name in COLOURS),
        (".paper", "fill", *PALETTE["paper"]),
        (".lp-grid", "stroke", *PALETTE["line"]),
        (".lp-span", "fill", *PALETTE["late"]),
        (".lp-dashed", "stroke", *PALETTE["quiet"]),
        (".lp-mark", "fill", *PALETTE["quiet"]),
        (".lp-name", "fill", *PALETTE["ink"]),
    ),
)


@dataclass(frozen=True, slots=True)
class Curve:
    """Points in order of time, s; `is_dashed` for a reference, `is_dots` for points apart."""

    name: str
    points: Points
    is_dashed: bool = False
    is_dots: bool = False


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time that is shaded, with a word or two at its top."""

    from_s: float
    until_s: float
    name: str = ""


@dataclass(frozen=True, slots=True)
class LinePlot:
    """Curves on common axes, with a legend above."""

    title: str
    across: str
    up: str
    curves: Sequence[Curve]
    spans: Sequence[Span] = ()
    across_ends: Ends | None = None
    """The least and greatest that the axis shows; None: what the curves have."""
    up_ends: Ends | None = None
    width: float = WIDTH
    height: float = HEIGHT
    has_equal_scales: bool = False
    """True if a unit is as long across as it is up, as on a map."""
    is_nested: bool = False
    """True if each curve is thinner than the one before, so that equal ones can all be seen."""

    @property
    def reach(self) -> tuple[Ends, Ends]:
        """Ends of its axes: across, and up."""
        points = [point for curve in self.curves for point in curve.points] or [(0.0, 0.0)]
        across = self.across_ends or _ends([at for at, _ in points])
        return across, self.up_ends or _ends([value for _, value in points])

    def svg(self) -> Element:
        """The picture."""
        canvas = Canvas()
        rows = _legend_rows(self.curves, self.up, self.width)
        top = _TOP + _ROW * (len(rows) - 1)
        across, up = self._ends(top)
        x = Axis(*across, _LEFT, self.width - _RIGHT)
        y = Axis(*up, self.height - _BOTTOM, top)
        for span in self.spans:
            _draw_span(canvas, span, x, y)
        self._draw_grid(canvas, x, y)
        for number in range(len(self.curves)):
            self._draw_curve(canvas, number, x, y)
        self._draw_legend(canvas, rows)
        whole = Rectangle(0.0, 0.0, self.width, self.height)
        return canvas.svg(whole, self.title, _STYLE, _LARGEST)

    def text(self) -> str:
        """The text of the SVG file."""
        return file_text(self.svg())

    def _ends(self, top: float) -> tuple[Ends, Ends]:
        """Return the ends of the axes; with equal scales the shorter one shows more."""
        across, up = self.reach
        if not self.has_equal_scales:
            return across, up
        wide, high = self.width - _LEFT - _RIGHT, self.height - _BOTTOM - top
        unit = max((across[1] - across[0]) / wide, (up[1] - up[0]) / high)
        return _around(across, unit * wide), _around(up, unit * high)

    def _draw_grid(self, canvas: Canvas, x: Axis, y: Axis) -> None:
        for mark in _marks(x):
            at = x.pixel(mark)
            canvas.line((at, y.begin), (at, y.end), "lp-line lp-grid")
            canvas.text((at, y.begin + 16), f"{mark:.6g}", "lp-mark", "middle")
        for mark in _marks(y):
            at = y.pixel(mark)
            canvas.line((x.begin, at), (x.end, at), "lp-line lp-grid")
            canvas.text((x.begin - 7, at + 4), f"{mark:.6g}", "lp-mark", "end")
        canvas.text(((x.begin + x.end) / 2, y.begin + 36), self.across, "lp-mark", "middle")
        canvas.text((_LABEL_AT, _TOP - 20), self.up, "lp-mark")

    def _draw_curve(self, canvas: Canvas, number: int, x: Axis, y: Axis) -> None:
        curve, rest = self.curves[number], self.curves[number + 1 :]
        css = _css(number, curve)
        if curve.is_dots:
            for at, value in curve.points:
                canvas.circle((x.pixel(at), y.pixel(value)), _DOT, f"lp-dot {css}")
            return
        thinner = sum(not each.is_dashed for each in rest)
        places = (point((x.pixel(at), y.pixel(value))) for at, value in _thinned(curve.points))
        wide = _LINE + thinner if self.is_nested and not curve.is_dashed else None
        css = f"lp-line {css}" if wide else f"lp-line lp-curve {css}"
        canvas.put("polyline", css, curve.name, points=" ".join(places), stroke_width=wide)

    def _draw_legend(self, canvas: Canvas, rows: Sequence[Sequence[int]]) -> None:
        for row, numbers in enumerate(rows):
            at, y = self.width - _RIGHT, 18 + _ROW * row
            for number in reversed(numbers):
                curve = self.curves[number]
                at -= text_width(curve.name)
                css = f"lp-line lp-curve {_css(number, curve)}"
                canvas.line((at - 22, y - 4), (at - 4, y - 4), css)
                canvas.text((at, y), curve.name, "lp-name")
                at -= _BETWEEN


@dataclass(frozen=True, slots=True)
class Picture:
    """A drawing that is no plot of curves, such as a rig's of its world: text of an SVG file."""

    title: str
    source: str

    def svg(self) -> Element:
        """The picture as a page shows it; its style sheet holds for nothing else there."""
        source = b64encode(self.source.encode()).decode()
        return element(
            "img",
            src=f"data:image/svg+xml;base64,{source}",
            alt=self.title,
            style="display:block;width:100%;height:auto",
        )

    def text(self) -> str:
        """The text of the SVG file."""
        return self.source


def figure_of(plot: LinePlot | Picture) -> Element:
    """A plot on a page, with its title above it."""
    return element("figure", element("figcaption", plot.title), plot.svg())


def histogram(name: str, counts: Sequence[int], lowest: float, highest: float) -> LinePlot:
    """Histogram as a line around its bars: `counts` in equal parts from lowest to highest."""
    wide = (highest - lowest) / len(counts) or abs(lowest) or 1.0
    points = [(lowest, 0.0)]
    for index, rows in enumerate(counts):
        begin = lowest + index * wide
        points += [(begin, float(rows)), (begin + wide, float(rows))]
    points.append((lowest + len(counts) * wide, 0.0))
    ends = (points[0][0], points[-1][0])
    return LinePlot(
        title=name, across=name, up="runs", curves=[Curve(name, points)], across_ends=ends
    )


def on_common_axes(plots: Mapping[str, LinePlot]) -> dict[str, LinePlot]:
    """The plots with one axis for each quantity: equal labels, equal ends."""
    across: dict[str, Ends] = {}
    up: dict[str, Ends] = {}
    for plot in plots.values():
        for label, ends, found in zip(
            (plot.across, plot.up), plot.reach, (across, up), strict=True
        ):
            low, high = found.get(label, ends)
            found[label] = min(low, ends[0]), max(high, ends[1])
    return {
        name: replace(plot, across_ends=across[plot.across], up_ends=up[plot.up])
        for name, plot in plots.items()
    }


def _around(ends: Ends, length: float) -> Ends:
    """An axis of this length about the middle of another."""
    middle = (ends[0] + ends[1]) / 2
    return middle - length / 2, middle + length / 2


def _ends(values: Sequence[float]) -> Ends:
    """The least and greatest, apart."""
    low, high = min(values), max(values)
    room = 0.04 * (high - low) or max(abs(low), 1.0) * 0.5
    return (low - room if low < 0 or low > room else min(low, 0.0)), high + room


def _marks(axis: Axis) -> list[float]:
    """A few round values, two on a short axis."""
    pixels = abs(axis.end - axis.begin)
    return axis.ticks(min(max(pixels / _MOST_MARKS, _LEAST_APART), pixels / 2))


def _draw_span(canvas: Canvas, span: Span, x: Axis, y: Axis) -> None:
    """A shaded stretch, cut off where the axis ends."""
    left, right = (x.pixel(max(x.low, min(x.high, at))) for at in (span.from_s, span.until_s))
    tooltip = f"{span.name} {span.from_s:.2f} to {span.until_s:.2f}".strip()
    canvas.rectangle(Rectangle(left, y.end, right - left, y.begin - y.end), "lp-span", tooltip)
    canvas.text(((left + right) / 2, y.end + 14), span.name, "lp-mark", "middle")


def _css(number: int, curve: Curve) -> str:
    """The class of a curve's colour."""
    return "lp-dashed" if curve.is_dashed else f"lp-{COLOURS[number % len(COLOURS)]}"


def _thinned(points: Points) -> Iterator[tuple[float, float]]:
    """The least and the greatest of every so many points, so that no peak is lost."""
    every = -(-2 * len(points) // _MOST_POINTS)
    if every <= 2:
        yield from points
        return
    for begin in range(0, len(points), every):
        some = points[begin : begin + every]
        ends = (choose(some, key=lambda point: point[1]) for choose in (min, max))
        yield from sorted(dict.fromkeys(ends))


def _legend_rows(curves: Sequence[Curve], label: str, width: float) -> list[list[int]]:
    """Numbers of the curves that are named in each row: one row, or several below the label."""
    room = width - _RIGHT - _LABEL_AT
    lengths = [text_width(curve.name) + _BETWEEN for curve in curves]
    if sum(lengths) + text_width(label) <= room:
        return [list(range(len(curves)))]
    rows: list[list[int]] = [[], []]
    for number, length in enumerate(lengths):
        if rows[-1] and sum(lengths[each] for each in rows[-1]) + length > room:
            rows.append([])
        rows[-1].append(number)
    return rows
